/* What the script claims: green or red, with the time at which it fails. */
import {byId, make} from "./dom.js";

const number = (value) => String(Number(value.toPrecision(6)));

export class Claims {
  constructor(app) {
    this.app = app;
    this.found = [];
    this.pointed = null;
  }

  told({rev, claims}) {
    const {app} = this;
    if (rev !== app.rev) return;
    this.found = claims.map((item) => ({...item, range: item.span ? app.offsets.span(item.span) : null}));
    this.show();
    app.clock.broken(this.found.flatMap((item) => item.failing || []));
    app.stage.draw();
  }

  /* Another text: what was judged may not hold any more. */
  doubt() {
    byId("claims").classList.toggle("stale", this.found.length > 0);
  }

  forget() {
    if (this.found.length) this.told({rev: this.app.rev, claims: []});
  }

  show() {
    const place = byId("claims");
    place.hidden = !this.found.length;
    place.classList.remove("stale");
    place.replaceChildren(...this.found.map((item, k) => {
      const proved = item.holds && (item.proof || "").startsWith("proved");
      const words = item.holds ? item.words : `${item.words}: fails from t = ${number(item.time)}`;
      const title = proved ? "This claim holds in every position of the mechanism, not only in the film. Click to show its parts."
        : item.holds ? "This claim holds in the whole film. Click to show its parts."
        : `Go to where it fails. ${item.worst === null ? "It has no value there." : `It is off by at most ${number(item.worst)}, at t = ${number(item.at)}.`}`;
      const point = (on) => () => { this.pointed = on ? item : null; this.app.stage.draw(); };
      return make("button", {
        type: "button", class: `claim ${item.holds ? "holds" : "fails"}`, "data-testid": `claim-${k}`, "data-holds": String(item.holds), "data-proof": item.proof || "", title,
        onclick: () => this.go(item), onpointerenter: point(true), onpointerleave: point(false), onfocus: point(true), onblur: point(false),
      }, make("b", {text: item.holds ? "✓" : "✗", "aria-label": item.holds ? "holds" : "fails"}), make("span", {text: words}));
    }));
    this.mark();
  }

  go(item) {
    const {app} = this;
    if (!item.holds) { app.clock.pause(); app.clock.seek(item.frame); }
    if (item.range && app.spansRev === app.rev) app.editor.select(item.range);
    app.stage.draw();
  }

  fails(item, frame) {
    return (item.failing || []).some(([first, last]) => first <= frame && frame <= last);
  }

  /* Those that fail in the frame on show. */
  mark() {
    const {frame} = this.app.clock;
    this.found.forEach((item, k) => {
      const made = byId("claims").children[k];
      if (made) made.classList.toggle("now", this.fails(item, frame));
    });
  }

  /* [[thing, colour]]: red what a claim is about that fails now; green what one is about that is pointed at. */
  colors() {
    const {frame} = this.app.clock, found = new Map();
    if (this.pointed && !this.fails(this.pointed, frame)) for (const thing of this.pointed.things) found.set(thing, "rgba(26, 140, 70, 0.45)");
    for (const item of this.found) {
      if (this.fails(item, frame)) for (const thing of item.things) found.set(thing, "rgba(210, 30, 45, 0.4)");
    }
    return [...found];
  }
}
