// The page of one file's picture.

import { $ } from "./common.js";
import { Picture } from "./picture.js";

const payload = JSON.parse($("data").textContent);
new Picture($("layers"), payload).show(payload.pictures[0]);
