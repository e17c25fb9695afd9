/* The mouse's work by keys: points one after the other, a cross that moves anywhere, a part that is pulled along. */

const STEP = 5; // world pixels

export class Cross {
  constructor(app) {
    this.app = app;
    this.number = -1;
    this.at = null;
    this.grip = null;
    app.stage.under.push((context, px) => this.draw(context, px));
    app.stage.canvas.addEventListener("pointerdown", () => this.leave());
  }

  leave() {
    if (this.grip) this.grip.done = true;
    this.at = this.grip = null;
    this.app.stage.draw();
  }

  /* The next point, or the one before. */
  next(by) {
    const {app} = this, anchors = app.stage.anchors().filter(({thing}) => !app.stage.scene.things[thing].hidden);
    if (!anchors.length) return;
    this.leave();
    this.number = (this.number + by + anchors.length) % anchors.length;
    const hit = anchors[this.number];
    app.stage.hovered = hit;
    this.at = hit.at;
    app.hint(`${hit.name} at ${hit.at.map((value) => Number(value.toFixed(1))).join(", ")}`);
    app.stage.draw();
  }

  /* Move the cross; with Select, the point that it is at follows. */
  move(dx, dy) {
    const {app} = this, {stage} = app;
    const [left, bottom, right, top] = stage.paper();
    const from = this.at || [Math.round((left + right) / 2), Math.round((bottom + top) / 2)];
    if (app.pointer.tool === "select" && stage.hovered && stage.hovered.at && !this.grip) {
      app.clock.pause();
      this.grip = app.hand.grab(stage.hovered, stage.hovered.at);
    }
    this.at = [from[0] + STEP * dx, from[1] + STEP * dy];
    if (this.grip) app.hand.move(this.grip, this.at);
    else {
      stage.hovered = stage.hit(this.at);
      app.hint(`${this.at.map((value) => Number(value.toFixed(1))).join(", ")}${stage.hovered ? `: ${stage.hovered.name}` : ""}`);
    }
    stage.draw();
  }

  /* Use the tool where the cross is. */
  use() {
    const {app} = this, {stage, pointer} = app, {tool} = pointer;
    if (!this.at) { this.move(0, 0); return; }
    const anchorsOnly = ["fix", "attract", "shape"].includes(tool), partsOnly = ["angle", "turn"].includes(tool);
    const chosen = !anchorsOnly && !partsOnly && stage.hovered && stage.hovered.at ? stage.hovered : null;
    const hit = chosen && Math.hypot(chosen.at[0] - this.at[0], chosen.at[1] - this.at[1]) < 1e-9 ? chosen : stage.hit(this.at, {anchorsOnly, partsOnly});
    if (tool === "shape") { this.shape(hit); return; }
    pointer[tool]({tool, hit, at: this.at, dragged: false, grip: null}, this.at);
  }

  /* First the point, then where it is to be. */
  shape(hit) {
    const {pointer} = this.app;
    if (!pointer.first) {
      if (!hit) { this.app.hint("Start at a point."); return; }
      pointer.first = hit;
      this.app.hint(`${hit.name}: move the cross (Shift and the arrows), then Enter.`);
      return;
    }
    const first = pointer.first;
    pointer.first = null;
    pointer.shape({hit: first, dragged: true}, this.at);
  }

  draw(context, px) {
    if (!this.at) return;
    const [x, y] = this.at, size = 12 * px;
    for (const [color, width] of [["#fff", 4 * px], ["#d55e00", 1.5 * px]]) {
      context.strokeStyle = color;
      context.lineWidth = width;
      context.beginPath();
      context.moveTo(x - size, y);
      context.lineTo(x + size, y);
      context.moveTo(x, y - size);
      context.lineTo(x, y + size);
      context.stroke();
    }
  }
}
