// The playbacks of a suite's worst failures: each is inflated when it is wanted, and so is its road.

import { $ } from "./common.js";
import { ZONED } from "./conflict.js";
import { data } from "./data.js";
import { glyph } from "./glyph.js";
import { hook } from "./hook.js";
import { inflated } from "./inflate.js";
import { Player } from "./player.js";
import { suite } from "./suite_words.js";

const packed = suite.motions;
const made = new Map(); // number → the playback, or its promise
const unpacked = async (text) => JSON.parse(new TextDecoder().decode(await inflated(text)));

class Motions {
  constructor() {
    this.wanted = -1;
    this.owner = null;
    /** @type {Player | null} */
    this.player = null;
  }

  // The number of the playback of that name; −1 if there is none.
  named(name) {
    return packed.names.indexOf(name);
  }

  async get(k) {
    if (!made.has(k)) made.set(k, this.read(k));
    return made.get(k);
  }

  async read(k) {
    const on = packed.on[k], [kept, road] = await Promise.all([unpacked(packed.texts[k]), data.roads[on] ?? unpacked(packed.roads[on])]);
    data.roads[on] = road;
    kept.road = on;
    if (kept.twin) {
      Object.assign(kept, { driver: suite.egos[1] });
      Object.assign(kept.twin, { driver: suite.egos[0], road: on });
    }
    data.kept.push(kept); // the player's address is by name
    return kept;
  }

  // A picture of the contact or near miss of one, in an element, once it is read; of two drivers, the second's before the first's.
  async picture(k, host) {
    const kept = await this.get(k), shown = [kept, kept.twin].find((one) => ZONED.includes(one?.conflict?.conflict)), made = shown && glyph(shown);
    if (made) host.replaceChildren(made);
  }

  // Who has the player closes where it was: there is one.
  take(owner) {
    if (this.owner && this.owner !== owner) this.owner.close();
    this.owner = owner;
  }

  // Plays one inside an element.
  async show(k, host, seconds) {
    this.wanted = k;
    $("player").setAttribute("aria-busy", "true");
    const kept = await this.get(k);
    if (this.wanted !== k || !host.isConnected) return; // another was chosen meanwhile
    host.append($("player"));
    $("player").removeAttribute("aria-busy");
    this.player ??= new Player(hook);
    this.player.show(kept);
    if (seconds !== null) this.player.seek(Math.round(seconds / kept.time_step), false);
  }

  park() {
    this.wanted = -1;
    this.player?.pause();
    $("parked").append($("player"));
  }
}

export const motions = new Motions();
