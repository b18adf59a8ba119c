// Charts are drawn when they come near the screen, and anew, after something has changed, when they are near it.

class NearScreen {
  // charts: what draws each element. drawn(): told after each drawing.
  constructor(charts, drawn) {
    this.charts = charts;
    this.drawn = drawn;
    this.near = new Set();
    this.stale = new Set(charts.keys());
    const watch = new IntersectionObserver((entries) => {
      for (const { isIntersecting, target } of entries) {
        this.near[isIntersecting ? "add" : "delete"](target);
        if (isIntersecting && this.stale.has(target)) this.draw(target);
      }
    }, { rootMargin: "500px" });
    for (const plot of charts.keys()) watch.observe(plot);
    addEventListener("beforeprint", () => {
      for (const plot of [...this.stale]) this.draw(plot); // paper shows what no screen has shown
    });
  }

  draw(plot) {
    this.stale.delete(plot);
    this.charts.get(plot)();
    this.drawn();
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
