// What the bird's-eye view shows at each instant: the conflict, the whole motion, or the ego in the middle.

import { boxCentre, boxCorners, isPlaced, nearestTo, playersOf, stateAt } from "./geometry.js";
import { ghostsAt } from "./ghosts.js";
import { phantomsAt } from "./unpack.js";

const AROUND_BODIES = 5; // m around the bodies
const LEAST_SCALE = 8; // pixels per metre at which a car is still seen well
const MOST_SCALE = 20;
const EGO_WITHIN = 0.34; // share of the width and height within which the ego stays
const TOO_SMALL = 2; // pixels per metre: below that a car is a few pixels
const GHOST_WITHIN = 50; // m from the body: nearer ones, of another simulator or driver, are kept in sight
const ACROSS = 100; // m across, that are shown where the ego is kept in the middle

// The other participant of the conflict, else whoever comes nearest to the ego; 0 if nobody does.
function partnerOf(kept) {
  const shown = kept.conflict?.partner_number || kept.conflict?.vehicle_number;
  if (shown > 0) return shown;
  const near = kept.closest === null ? null : nearestTo(kept, stateAt(kept, kept.closest));
  return near ? near.entity : 0;
}

export class Camera {
  constructor(view, kept, centres) {
    Object.assign(this, { view, kept, centres });
    this.partner = partnerOf(kept);
    if (view.framing === "chase") return; // the reader's choice stays, whatever is shown
    this.frame(this.partner ? "conflict" : "all");
    if (view.framing === "all" && view.scale < TOO_SMALL) this.frame("ego");
  }

  /** @param {"conflict" | "all" | "ego" | "chase"} framing */
  frame(framing) {
    const { view } = this;
    if (framing === "chase" && view.framing === "chase") view.orbit.pitch = view.orbit.pitch > 1 ? 0.26 : Math.PI / 2; // once more: from above, and back
    view.framing = framing;
    view.factor = 1;
    if (framing === "all") view.fit(playersOf(this.kept).flatMap((e) => this.centres[e]).filter(Boolean), AROUND_BODIES);
    if (framing === "ego") view.scale = Math.max(view.scale, Math.min(LEAST_SCALE, view.canvas.clientWidth / ACROSS));
  }

  // After the canvas has changed its size.
  again() {
    if (this.view.framing === "all") this.frame("all");
  }

  // Moves the view to an instant. Both bodies are in sight unless they are too far apart; then the ego is.
  aim(state) {
    const { view } = this, [ego] = state.entities;
    if (view.framing === "all" || view.framing === null || !isPlaced(ego)) return;
    const centre = boxCentre(this.kept.entities[0], ego.x, ego.y, ego.h);
    if (view.framing === "ego") return void view.centre(centre);
    const corners = [0, this.partner].filter((e) => isPlaced(state.entities[e])).flatMap((e) => {
      const { x, y, h } = state.entities[e];
      return boxCorners(this.kept.entities[e], x, y, h);
    });
    const ghosts = ghostsAt(this.kept, state).filter(({ entity, off }) => [0, this.partner].includes(entity) && off < GHOST_WITHIN);
    corners.push(...ghosts.flatMap(({ entity, x, y, h }) => boxCorners(this.kept.entities[entity], x, y, h)));
    corners.push(...phantomsAt(this.kept, state.index).filter(({ dx, dy }) => Math.hypot(dx, dy) < GHOST_WITHIN).map(({ x, y }) => [x, y]));
    view.fit(corners, AROUND_BODIES, [LEAST_SCALE, MOST_SCALE]);
    view.keep(centre, EGO_WITHIN);
  }
}
