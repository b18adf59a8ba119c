// Charts are drawn when they come near the screen, else when the page is idle; and anew, after something has changed, when they are near it.

import { hook } from "./hook.js";

class NearScreen {
  constructor() {
    this.charts = new Map(); // element → what draws it
    this.near = new Set();
    this.stale = new Set();
    this.watch = new IntersectionObserver((entries) => {
      for (const { isIntersecting, target } of entries) {
        this.near[isIntersecting ? "add" : "delete"](target);
        if (isIntersecting && this.stale.has(target)) this.draw(target);
      }
    }, { rootMargin: "500px" });
    addEventListener("beforeprint", () => {
      for (const plot of [...this.stale]) this.draw(plot); // paper shows what no screen has shown
    });
    // A picture of the whole page is taken without scrolling.
    addEventListener("load", () => this.rest());
    document.addEventListener("theme", () => this.all());
    document.addEventListener("grown", () => this.all());
  }

  // Draws what is left, one at a time.
  rest() {
    const left = [...this.stale], idle = window.requestIdleCallback ?? ((then) => setTimeout(then, 200));
    const next = () => {
      const plot = left.pop();
      if (plot && this.stale.has(plot)) this.draw(plot);
      if (left.length) idle(next);
    };
    idle(next);
  }

  add(plot, draw) {
    this.charts.set(plot, draw);
    this.stale.add(plot);
    hook.charts = this.charts.size;
    this.watch.observe(plot);
  }

  draw(plot) {
    if (!plot.clientWidth) return void this.stale.add(plot); // in a section that is folded
    this.stale.delete(plot);
    this.charts.get(plot)();
    hook.chartsDrawn += 1;
  }

  again(plot) {
    if (!this.charts.has(plot)) return;
    if (this.near.has(plot)) this.draw(plot);
    else this.stale.add(plot);
  }

  all() {
    for (const plot of this.charts.keys()) this.again(plot);
  }
}

export const near = new NearScreen();
