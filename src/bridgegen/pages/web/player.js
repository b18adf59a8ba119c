// The clock of the playback and its controls; the scene and the curves draw what it says.

import { addressOf } from "./address.js";
import { $, copy, element } from "./common.js";
import { ZONED, fillConflict } from "./conflict.js";
import { intentionAt, plannedAt } from "./course.js";
import { Curves } from "./curves.js";
import { data } from "./data.js";
import { boxCentre, colourOf, isPlaced, playersOf, stateAt } from "./geometry.js";
import { ghostsAt, ghostsOf } from "./ghosts.js";
import { Save } from "./save.js";
import { Scene } from "./scene.js";
import { detectionAt, lightAt, unpack, weatherAt } from "./unpack.js";
import { phantomWords, stateWords } from "./words.js";

const CALM = matchMedia("(prefers-reduced-motion: reduce)");
const PLAY_ICON = "M4 2v12l10-6z";
const PAUSE_ICON = "M3 2h4v12H3zM9 2h4v12H9z";
/** @type {["zoom-fit" | "zoom-all" | "follow" | "chase", "conflict" | "all" | "ego" | "chase"][]} */
const FRAMINGS = [["zoom-fit", "conflict"], ["zoom-all", "all"], ["follow", "ego"], ["chase", "chase"]];

const clockWords = ({ time, distance }) => `${time.toFixed(2)}\u00a0s  ·  distance\u00a0${distance === null ? "–" : `${distance.toFixed(2)}\u00a0m`}`;

export class Player {
  constructor(hook) {
    this.hook = hook;
    this.playing = false;
    this.describedAt = 0; // [ms], of the last description
    this.position = 0; // in steps; whole on a recorded instant
    this.scene = new Scene($("scene"), () => this.redraw());
    this.scenes = [this.scene]; // of two drivers, that of the first, too
    this.twinScene = null;
    this.curves = new Curves($("curves"), (k) => this.seek(k));
    new Save(this);
    this.connect();
    Object.assign(hook, {
      seek: (k) => this.seek(k), play: () => this.play(), pause: () => this.pause(),
      state: () => ({ ...this.drawn, playing: this.playing }), curves: this.curves,
    });
  }

  get last() {
    return Math.max(this.kept.n_steps, this.twin?.n_steps ?? 0) - 1;
  }

  // The contacts of the playback; of two drivers those of the second, else of the first.
  get contacts() {
    return this.kept.contacts.length ? this.kept.contacts : this.twin?.contacts ?? [];
  }

  // Shows a scenario at its decisive instant, the moment that tells most; a click plays it from the start.
  show(kept, andPlay = false) {
    this.pause();
    this.kept = unpack(kept);
    this.chosen = data.kept.indexOf(kept); // −1 of one that was not exported
    $("scene-name").textContent = `${this.kept.name}`;
    this.pair(kept.twin);
    this.fill();
    this.seek(this.kept.diverged ?? this.kept.conflict?.instant ?? this.kept.closest ?? 0, false);
    if (!andPlay) return;
    if ($("player").getBoundingClientRect().bottom > innerHeight) {
      $("player").scrollIntoView({ block: "nearest", behavior: CALM.matches ? "auto" : "smooth" });
    }
    this.link();
    this.begin();
  }

  // Shows another motion of the same bodies on the same road, at the same time of it.
  swap(kept) {
    this.pause();
    this.kept = kept;
    this.fill();
    this.seek(this.position, false);
  }

  fill() {
    const { kept } = this;
    $("scrub").max = this.last;
    $("to-contact").hidden = !this.contacts.length;
    $("to-closest").hidden = kept.closest === null || kept.contacts.includes(kept.closest);
    $("to-diverged").hidden = (kept.diverged ?? null) === null;
    this.scene.show(kept);
    if (this.twinScene) this.showTwin();
    this.curves.show(kept, this.twin);
    this.showLegend();
    fillConflict(kept, this.twin);
  }

  // Both scenes keep the same partner in sight.
  showTwin() {
    const { kept, twin } = this, partner = [kept, twin].map((one) => one.conflict?.partner_number ?? 0).find((e) => e > 0);
    this.twinScene.show(twin);
    if (!partner) return;
    for (const { camera } of this.scenes) {
      camera.partner = partner;
      if (camera.view.framing !== "chase") camera.frame("conflict");
    }
  }

  // The same scenario with another driver, in step: its scene stands before that of this one.
  pair(packed) {
    this.twin = packed ? unpack(packed) : null;
    $("player").classList.toggle("paired", Boolean(packed));
    $("twin").hidden = $("twin-now").hidden = !packed;
    if (!packed) {
      this.scenes = [this.scene];
      this.twinScene = null;
      return;
    }
    this.otherScene ??= new Scene($("twin-scene"), () => this.redraw());
    this.twinScene = this.otherScene;
    this.twinScene.layers = this.scene.layers;
    // The same bodies have the same colours in both.
    this.kept.players = this.twin.players = [...new Set([...playersOf(this.kept), ...playersOf(this.twin)])];
    this.scenes = [this.twinScene, this.scene];
    $("twin-name").textContent = this.twin.driver;
    $("scene-name").textContent = this.kept.driver;
  }

  // Plays from the start, unless the reader wants no motion.
  begin() {
    if (CALM.matches) return;
    this.position = 0;
    this.play();
  }

  seek(step, link = true) {
    this.position = Math.min(this.last, Math.max(0, step));
    if (link && !this.playing) this.link();
    this.redraw();
  }

  // The page's address names scenario and time, so that it can be sent on.
  link() {
    clearTimeout(this.linking);
    this.linking = setTimeout(() => {
      history.replaceState(null, "", this.address());
      $("said").textContent = $("now").textContent; // once it rests: a screen reader does not read every frame
    }, 250);
  }

  // The page's address with the present scenario and time, to the instant.
  address() {
    return this.kept.minimal ? location.hash || "#" : addressOf(this.kept, this.chosen >= 0, Math.round(this.position));
  }

  copyLink() {
    copy(`${location.href.split("#")[0]}${this.address()}`, $("copy-link"));
  }

  // Shows or hides one of the layers over the road.
  toggleLayer(layer) {
    this.scene.layers[layer] = !this.scene.layers[layer];
    this.showLegend();
    this.redraw();
  }

  showLegend() {
    $("legend-players").replaceChildren(...this.players());
    const has = { players: true, motion: true, conflict: ZONED.includes(this.kept.conflict?.conflict), sensed: this.kept.sensed, course: this.kept.course || this.kept.plans?.length, weather: this.kept.weather.length, elsewhere: ghostsOf(this.kept).length };
    for (const item of $("legend").children) {
      const shown = this.scene.layers[item.dataset.layer], button = item.querySelector("button");
      item.hidden = !has[item.dataset.layer] || (!button && !shown);
      button?.setAttribute("aria-pressed", shown);
    }
    const plans = Boolean(this.kept.plans?.length);
    if (plans) {
      $("course-button").textContent = "Trajectory";
      $("band-legend").hidden = true;
    } else if (this.kept.course) {
      $("plan-legend").hidden = true;
      const tells = this.kept.course.acceleration.some((a) => a !== null);
      $("course-button").textContent = tells ? "Planned path" : "Way ahead";
      $("course-means").textContent = `in 1, 2, 3 s${tells ? "" : " if it goes on like this"}; a thick bar: it stands`;
    }
    if (has.elsewhere) $("elsewhere-means").textContent = [...new Set(ghostsOf(this.kept).map(({ means }) => means))].join("; ");
    if (has.elsewhere) $("elsewhere-button").textContent = ghostsOf(this.kept).some(({ simulator }) => simulator) ? "Elsewhere" : "Other driver";
    if (this.kept.sensed) $("displaced-means").textContent = `displaced by over ${this.kept.sensed.tolerance} m${this.kept.sensed.phantoms.length ? ", or nothing is there" : ""}`;
  }

  // Who is which colour, for the legend.
  players() {
    return playersOf(this.kept).map((e) => {
      const dot = element("i", { "aria-hidden": "true" });
      dot.style.background = colourOf(this.kept, e);
      return element("span", { class: "swatch" }, dot, this.kept.entities[e].name);
    });
  }

  play() {
    if (this.playing) return;
    if (this.position >= this.last) this.position = 0;
    this.setPlaying(true);
    let before = null;
    const tick = (now) => {
      if (!this.playing) return;
      if (before !== null) {
        // A hidden tab stops the clock; coming back must not jump.
        const seconds = Math.min(0.1, (now - before) / 1000) * Number($("speed").value);
        this.position = Math.min(this.last, this.position + seconds / this.kept.time_step);
      }
      before = now;
      this.redraw();
      if (this.position >= this.last) this.pause();
      else requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  pause() {
    if (!this.playing) return;
    this.setPlaying(false);
    this.position = Math.round(this.position);
    this.link();
    this.redraw();
  }

  setPlaying(playing) {
    this.playing = playing;
    $("play-icon").setAttribute("d", playing ? PAUSE_ICON : PLAY_ICON);
    $("play").setAttribute("aria-label", playing ? "Pause" : "Play");
  }

  step(by) {
    this.pause();
    this.seek(Math.round(this.position) + by);
  }

  redraw() {
    const state = stateAt(this.kept, this.position);
    this.scene.draw(state);
    this.curves.draw(state);
    $("clock").textContent = clockWords(state);
    this.redrawTwin();
    for (const [id, framing] of FRAMINGS) $(id).setAttribute("aria-pressed", this.scene.view.framing === framing);
    this.drawFlag(state);
    $("scrub").value = Math.round(this.position);
    const weather = weatherAt(this.kept, state.index);
    this.describe(state, weather);
    this.drawn = {
      scenario: this.kept.name, chosen: this.chosen, position: this.position, ...state,
      screen: this.scene.pixels ?? state.entities.map((s, e) => (isPlaced(s) ? this.scene.view.toScreen(boxCentre(this.kept.entities[e], s.x, s.y, s.h)) : null)),
      scale: this.scene.view.scale, labels: this.scene.labels.boxes, crosses: this.scene.crosses,
      lights: this.kept.lamps.map((lamp) => lightAt(lamp, state.index)),
      detections: state.entities.map((_, e) => (e > 0 ? detectionAt(this.kept, e, state.index) : null)),
      diverged: this.twin ? this.kept.diverged : null, twin: this.twin && stateAt(this.twin, this.position), intention: intentionAt(this.kept, state), planned: plannedAt(this.kept, state), weather, elsewhere: this.scene.layers.elsewhere ? ghostsAt(this.kept, state) : [],
    };
  }

  redrawTwin() {
    if (!this.twinScene) return;
    const state = stateAt(this.twin, this.position);
    this.twinScene.draw(state);
    $("twin-clock").textContent = clockWords(state);
    if (!this.playing) $("twin-now").textContent = `${this.twin.driver}: ${stateWords(this.twin, state)}`;
  }

  // In words; while it plays, as often as one can read.
  describe(state, weather) {
    if (this.playing && performance.now() - this.describedAt < 250) return;
    this.describedAt = performance.now();
    const now = `${this.twin ? `${this.kept.driver}: ` : ""}${stateWords(this.kept, state)}`;
    $("now").textContent = now;
    $("scrub").setAttribute("aria-valuetext", now);
    $("weather").hidden = !weather;
    if (weather) $("weather").textContent = weather.words;
  }

  drawFlag(state) {
    const flag = $("flag");
    const contact = this.kept.contacts.some((k) => state.index >= k && state.index < k + 1 / this.kept.time_step);
    const diverges = this.twin && state.index === this.kept.diverged;
    const found = ZONED.includes(this.kept.conflict?.conflict) ? this.kept.conflict : null;
    const label = contact ? "collision" : diverges ? "drivers diverge here" : state.index === found?.instant ? "least time to collision" : state.index === found?.decided ? "decided here" : state.index === this.kept.closest ? "minimum distance" : phantomWords(this.kept, state.index)[0] ?? "";
    flag.hidden = !label;
    flag.className = contact ? "" : "near";
    flag.textContent = label;
  }

  connect() {
    $("play").addEventListener("click", () => this.toggle());
    $("back").addEventListener("click", () => this.step(-1));
    $("forward").addEventListener("click", () => this.step(1));
    $("scrub").addEventListener("input", (event) => { this.pause(); this.seek(Number(event.target.value)); });
    $("zoom-in").addEventListener("click", () => this.zoom(1.4));
    $("zoom-out").addEventListener("click", () => this.zoom(1 / 1.4));
    for (const [id, framing] of FRAMINGS) $(id).addEventListener("click", () => this.frame(framing));
    $("copy-link").addEventListener("click", () => this.copyLink());
    for (const item of $("legend").children) item.querySelector("button")?.addEventListener("click", () => this.toggleLayer(item.dataset.layer));
    $("to-closest").addEventListener("click", () => this.jump(this.kept.closest));
    $("to-decided").addEventListener("click", () => this.jump(this.kept.conflict.decided));
    $("to-contact").addEventListener("click", () => this.jump(this.contacts[0]));
    $("to-diverged").addEventListener("click", () => this.jump(this.kept.diverged));
    document.addEventListener("keydown", (event) => this.key(event));
    new ResizeObserver(() => {
      for (const scene of this.scenes) scene.camera.again();
      this.redraw();
    }).observe($("player"));
  }

  toggle() {
    if (this.playing) this.pause();
    else this.play();
  }

  jump(k) {
    this.pause();
    this.seek(k);
  }

  frame(framing) {
    for (const scene of this.scenes) scene.camera.frame(framing);
    this.redraw();
  }

  zoom(factor) {
    for (const scene of this.scenes) scene.view.zoom(factor);
  }

  // Keys act while the focus is in the player, or nowhere and the player is in sight.
  key(event) {
    const focus = document.activeElement, inside = $("player").contains(focus);
    if (event.ctrlKey || event.metaKey || event.altKey || focus?.tagName === "SELECT" || (focus?.type === "range" && focus !== $("scrub"))) return;
    if (!inside && !(focus === document.body && this.inSight())) return;
    if (event.key === " " && inside && focus.tagName === "BUTTON") return; // the button's own
    const speed = $("speed");
    const faster = (by) => { speed.selectedIndex = Math.min(speed.length - 1, Math.max(0, speed.selectedIndex + by)); };
    const actions = {
      " ": () => this.toggle(), ArrowLeft: () => this.step(event.shiftKey ? -10 : -1), ArrowRight: () => this.step(event.shiftKey ? 10 : 1),
      ",": () => this.step(-1), ".": () => this.step(1), s: () => this.toggleLayer("sensed"), p: () => this.toggleLayer("course"), w: () => this.toggleLayer("weather"),
      g: () => this.toggleLayer("elsewhere"),
      l: () => this.copyLink(), e: () => this.frame("ego"), a: () => this.frame("all"), Home: () => this.jump(0), End: () => this.jump(this.last), f: () => this.frame("conflict"), b: () => this.frame("chase"),
      d: () => this.jump(this.kept.closest ?? 0), c: () => { if (this.contacts.length) this.jump(this.contacts[0]); },
      v: () => { if (!$("to-diverged").hidden) this.jump(this.kept.diverged); },
      t: () => { if (!$("to-decided").hidden) this.jump(this.kept.conflict.decided); },
      "+": () => this.zoom(1.4), "=": () => this.zoom(1.4), "-": () => this.zoom(1 / 1.4),
      "[": () => faster(-1), "]": () => faster(1),
    };
    const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action) return;
    event.preventDefault();
    action();
  }

  inSight() {
    const { top, bottom } = $("scene").getBoundingClientRect();
    return Math.min(bottom, innerHeight) - Math.max(top, 0) > (bottom - top) / 2;
  }
}
