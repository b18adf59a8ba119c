// The page of a logical scenario: its motion at the defaults, and sliders.

import { data } from "./data.js";
import { Explorer } from "./explore.js";
import { hook } from "./hook.js";
import { Player } from "./player.js";

const trial = new Player(hook);
trial.show(data.kept[0]);
new Explorer(trial).show(data.kept[0]);
document.addEventListener("theme", () => trial.redraw());
