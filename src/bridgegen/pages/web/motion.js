// The motion of scenarios from the server, of a page that is served.

import { taken } from "./inflate.js";
import { playbacks } from "./playbacks.js";

// The motion of an evaluation from the server; null if it is not available after all.
async function askMotion(evaluation) {
  try {
    const answer = await (await fetch(`motion/${evaluation}`)).json();
    return answer.playback ? taken({ ...answer, playbacks: [answer.playback] })[0] : null;
  } catch {
    return null;
  }
}

playbacks.ask = askMotion;
