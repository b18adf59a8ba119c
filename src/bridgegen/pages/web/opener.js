// Shows scenarios in the player, whatever their motion comes from.

import { readAddress } from "./address.js";
import { $ } from "./common.js";
import { worstViolation } from "./criteria_rows.js";
import { data, rows } from "./data.js";
import { fillDetails, showPicture } from "./details.js";
import { Explorer, simulated } from "./explore.js";
import { nearestToHarm } from "./findings.js";
import { number } from "./numbers.js";
import { minimals, playbacks } from "./playbacks.js";
import { Player } from "./player.js";

// What is known of a row of the page without its motion, in a playback's shape.
function factsOf(i) {
  const values = (group) => Object.fromEntries(rows.columns.filter((c) => c.group === group).map((c) => [c.name, c.values[i]]));
  const cause = rows.cause?.[i] ? data.causes.labels[rows.cause[i]] : "";
  return { name: "", conflict: null, evaluation: rows.evaluation[i], parameters: values("parameter"), metrics: values("metric"), files: [], cause, picture: null };
}

// Shows scenarios in the player, whatever their motion comes from.
export class Opener {
  constructor(hook) {
    this.hook = hook;
    this.wanted = null;
    /** @type {Player | null} */
    this.made = null;
    hook.select = (k, play) => this.kept(k, play);
    hook.open = (evaluation) => this.row(rows.evaluation.indexOf(evaluation));
    hook.show = (evaluation, seconds, play) => this.moment(evaluation, seconds, play);
    hook.showMinimal = (evaluation) => this.minimal(evaluation);
  }

  get player() {
    this.made ??= new Player(this.hook);
    return this.made;
  }

  kept(k, play = false) {
    this.wanted = data.kept[k].evaluation;
    this.show(data.kept[k], play);
  }

  async row(i, play = false) {
    const evaluation = rows.evaluation[i];
    this.wanted = evaluation;
    if (playbacks.keptAt.has(evaluation)) return this.kept(playbacks.keptAt.get(evaluation), play);
    $("player").setAttribute("aria-busy", "true");
    const playback = (playbacks.source(evaluation) ? await playbacks.get(evaluation) : null) ?? (await simulated(i, factsOf(i)));
    if (playback && !playback.metrics) { // one in the page's data, which has them by row
      const { parameters, metrics } = factsOf(i);
      Object.assign(playback, { parameters, metrics });
    }
    $("player").removeAttribute("aria-busy");
    if (this.wanted !== evaluation) return; // another was chosen meanwhile
    if (playback) this.show(playback, play);
    else this.without(factsOf(i));
  }

  show(playback, play) {
    $("no-motion").hidden = true;
    $("player").classList.remove("still");
    this.player.show(playback, play);
    this.detail(playback);
    this.explorer ??= new Explorer(this.player);
    this.explorer.show(playback);
  }

  // The figures, and how to see the motion.
  without(facts) {
    this.made?.pause();
    $("no-motion").hidden = false;
    $("player").classList.add("still");
    $("no-motion-name").textContent = `Evaluation ${number(facts.evaluation + 1)}`;
    $("no-motion-command").textContent = `${data.summary.view} --evaluation ${facts.evaluation + 1}`;
    history.replaceState(null, "", `#evaluation-${facts.evaluation + 1}`);
    this.detail(facts);
  }

  detail(one) {
    fillDetails(one);
    showPicture(one);
    document.dispatchEvent(new CustomEvent("shown", { detail: one.evaluation }));
  }

  // The simplest form of a failure mode, which is no row of the run.
  async minimal(evaluation) {
    this.wanted = `minimal ${evaluation}`;
    const playback = await minimals.get(evaluation);
    if (this.wanted !== `minimal ${evaluation}`) return;
    playback.minimal = true;
    this.show(playback, true);
    $("player").scrollIntoView({ block: "nearest" });
  }

  // A scenario at a time [s], brought into sight; or played.
  async moment(evaluation, seconds, play = false) {
    await this.row(rows.evaluation.indexOf(evaluation), play);
    if (play) return void $("player").scrollIntoView({ block: "nearest" });
    if (seconds !== null && this.made?.kept.evaluation === evaluation) this.player.seek(Math.round(seconds / this.player.kept.time_step));
    $("player").scrollIntoView({ block: "nearest" });
  }

  // What the page's address names, or the most critical.
  async begin() {
    addEventListener("hashchange", () => this.go());
    if (await this.go()) return;
    if (data.kept.length) {
      this.kept(0);
      this.player.begin();
    } else if (rows.critical.includes(1)) await this.row(rows.rank.indexOf(1));
    else if (worstViolation() !== null) await this.row(rows.evaluation.indexOf(worstViolation()));
    else if (nearestToHarm() !== null) {
      await this.row(rows.evaluation.indexOf(nearestToHarm()));
      this.made?.begin();
    }
  }

  // Shows what the page's address names, at that time; says whether it names one.
  async go() {
    const { name, evaluation, seconds } = readAddress();
    const named = data.kept.findIndex((kept) => kept.name === name), i = rows.evaluation.indexOf(evaluation);
    if (named >= 0) this.kept(named);
    else if (i >= 0) await this.row(i);
    else return false;
    if (seconds !== null && this.made?.kept.evaluation === this.wanted) this.player.seek(Math.round(seconds / this.player.kept.time_step));
    $("scenarios").scrollIntoView();
    return true;
  }
}
