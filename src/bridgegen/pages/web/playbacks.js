// Where a scenario's motion comes from: that of the exported ones is in the page's data.

import { data } from "./data.js";
import { Packed } from "./inflate.js";

export const SOURCES = {
  kept: "Exported as files; play it",
  packed: "Play it",
  served: "Play it: it is simulated when asked for",
  simulated: "Play it: the page simulates it",
  none: "Its motion is not in this page; show its figures, and the command that plays it",
};

class Playbacks {
  constructor() {
    this.keptAt = new Map(data.kept.map((kept, k) => [kept.evaluation, k]));
    this.packed = new Packed(data.packed);
    this.fetched = new Map();
    /** @type {(evaluation: number) => Promise<any>} the motion from the server, of a page that is served */
    this.ask = async () => null;
  }

  // A key of SOURCES, or null where the motion is not to be had.
  source(evaluation) {
    if (this.keptAt.has(evaluation)) return "kept";
    if (this.packed.has(evaluation)) return "packed";
    return data.live ? "served" : data.simulation && !data.simulation.refused && data.kept.length ? "simulated" : null;
  }

  // Of one that was not exported; null if it is unavailable.
  async get(evaluation) {
    if (this.packed.has(evaluation)) return this.packed.get(evaluation);
    if (this.source(evaluation) === "simulated") return null; // explore.js does
    const playback = this.fetched.get(evaluation) ?? (await this.ask(evaluation));
    if (playback) this.fetched.set(evaluation, playback);
    return playback;
  }
}

export const playbacks = new Playbacks();
export const minimals = new Packed(data.minimal); // simplest forms of failure modes, by the evaluation that stands for the mode
