/* Velocities of all anchors as arrows: exact rates from the server, some frames at a time. */
import {littleFloats} from "./dom.js";

const LONGEST = 0.16; // of the picture, the arrow of the fastest anchor
const COLOR = "#7b2d8e";

export class Velocities {
  constructor(app) {
    this.app = app;
    this.on = false;
    this.forget();
  }

  /* Another motion. */
  forget() {
    this.known = [];
    this.fastest = 0;
    this.asked = null;
  }

  show(on) {
    this.on = on;
    this.app.stage.draw();
  }

  told({rev, first, count, rates}) {
    if (rev !== this.app.shownRev) { this.asked = null; this.app.stage.draw(); return; }
    const values = littleFloats(rates);
    for (let k = 0; k + 1 < values.length; k += 2) {
      const size = Math.hypot(values[k], values[k + 1]);
      if (size > this.fastest) this.fastest = size;
    }
    this.known.push({first, count, values, each: values.length / count});
    this.asked = null;
    this.app.stage.draw();
  }

  /* (vx, vy) of every anchor in a frame, in pixels per time unit; null while that is not known. */
  at(frame) {
    const some = this.known.find(({first, count}) => first <= frame && frame < first + count);
    if (some) return some.values.subarray((frame - some.first) * some.each, (frame - some.first + 1) * some.each);
    if (this.asked === null) {
      this.asked = frame;
      this.app.send({kind: "rates", rev: this.app.shownRev, first: frame});
    }
    return null;
  }

  /* [{name, at, velocity}] of what moves at the frame on show, each place once. */
  list() {
    const {stage} = this.app;
    if (!this.on || !stage.picture || !stage.scene || stage.glimpse || stage.held) return [];
    const values = this.at(stage.picture.frame);
    if (values === null) return [];
    const seen = new Set(), found = [];
    let k = 0;
    stage.scene.things.forEach((thing, number) => {
      for (const [anchor, local] of Object.entries(thing.anchors)) {
        const velocity = [values[k], values[k + 1]];
        k += 2;
        if (!(Math.hypot(...velocity) > 1e-6 * this.fastest)) continue; // still, or without a rate
        const at = stage.picture.place(number, local, stage.picture.frame);
        const key = [...(at || []), ...velocity].map((value) => value.toFixed(2)).join();
        if (!at || thing.hidden) continue;
        found.push({name: `${thing.name}.${anchor}`, at, velocity, drawn: !seen.has(key)});
        seen.add(key);
      }
    });
    return found;
  }

  of(name) {
    return this.list().find((item) => item.name === name) || null;
  }

  draw(context, px) {
    const [left, bottom, right, top] = this.app.stage.rect;
    const scale = LONGEST * Math.min(right - left, top - bottom) / (this.fastest || 1);
    for (const {at: [x, y], velocity: [vx, vy], drawn} of this.list()) {
      if (!drawn) continue;
      const size = Math.hypot(vx, vy), [ux, uy] = [vx / size, vy / size];
      const length = size * scale, head = Math.min(8 * px, 0.6 * length);
      const tip = [x + ux * length, y + uy * length], neck = [tip[0] - ux * head, tip[1] - uy * head];
      for (const [color, width] of [["rgba(255, 255, 255, 0.8)", 4.5 * px], [COLOR, 2 * px]]) {
        context.strokeStyle = context.fillStyle = color;
        context.lineWidth = width;
        context.beginPath();
        context.moveTo(x, y);
        context.lineTo(...neck);
        context.stroke();
      }
      context.beginPath();
      context.moveTo(...tip);
      context.lineTo(neck[0] - uy * head / 2, neck[1] + ux * head / 2);
      context.lineTo(neck[0] + uy * head / 2, neck[1] - ux * head / 2);
      context.closePath();
      context.fill();
    }
  }
}
