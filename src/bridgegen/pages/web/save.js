// Saves the playback from the page: this moment as a picture, or the whole as a film, as it is seen.

import { palette } from "./colours.js";
import { $, element } from "./common.js";
import { pill } from "./labels.js";

const TYPES = ["video/webm;codecs=vp9", "video/webm;codecs=vp8", "video/mp4"];

const filmType = () => (window.MediaRecorder ? TYPES.find((type) => window.MediaRecorder.isTypeSupported(type)) : undefined);

// The scene with its clock, on a canvas of its own.
function paint(canvas) {
  const scene = $("scene"), ratio = scene.width / scene.clientWidth;
  if (canvas.width !== scene.width) canvas.width = scene.width;
  if (canvas.height !== scene.height) canvas.height = scene.height;
  const c = canvas.getContext("2d");
  c.setTransform(1, 0, 0, 1, 0, 0);
  c.drawImage(scene, 0, 0);
  c.setTransform(ratio, 0, 0, ratio, 0, 0);
  pill(c, { width: scene.clientWidth, height: scene.clientHeight }, `${$("scene-name").textContent}  ${$("clock").textContent}`, 0, 0, palette.ink);
}

export function download(blob, name) {
  const href = URL.createObjectURL(blob);
  element("a", { href, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(href), 10000);
}

export class Save {
  constructor(player) {
    this.player = player;
    this.canvas = document.createElement("canvas");
    const choice = $("save");
    choice.querySelector("[value=film]").hidden = !filmType();
    choice.addEventListener("change", () => {
      const { value } = choice;
      choice.value = "";
      if (value === "picture") this.picture();
      else if (value === "film") this.film();
    });
  }

  get name() {
    return this.player.kept.name.replace(/\W+/g, "-");
  }

  picture() {
    this.player.pause();
    paint(this.canvas);
    const at = this.player.drawn.time.toFixed(2);
    this.canvas.toBlob((blob) => download(blob, `${this.name}-${at}s.png`));
  }

  // Plays it once from the start and records that, view and speed as the reader sets them; a pause ends it.
  film() {
    const { player } = this, type = filmType(), parts = [];
    $("save").disabled = true;
    player.pause();
    player.seek(0);
    paint(this.canvas);
    const recorder = new window.MediaRecorder(this.canvas.captureStream(30), { mimeType: type, videoBitsPerSecond: 6e6 });
    recorder.addEventListener("dataavailable", ({ data }) => parts.push(data));
    recorder.addEventListener("stop", () => {
      $("save").disabled = false;
      download(new Blob(parts, { type }), `${this.name}.${type.slice(6, 10).replace(";", "")}`);
    });
    recorder.start();
    player.play();
    const record = () => {
      paint(this.canvas);
      if (player.playing) requestAnimationFrame(record);
      else setTimeout(() => recorder.stop(), 100); // the last frame is in it
    };
    requestAnimationFrame(record);
  }
}
