/* What can be done with what is under the pointer: right click, or a finger that rests. */
import {byId, glyph, make} from "./dom.js";

export class Context {
  constructor(app) {
    this.app = app;
    this.box = byId("context");
    document.addEventListener("pointerdown", (event) => { if (!this.box.contains(event.target)) this.shut(); });
    this.box.addEventListener("keydown", (event) => this.key(event));
  }

  shut() {
    this.box.hidden = true;
  }

  key(event) {
    const items = [...this.box.querySelectorAll("button")], place = items.indexOf(document.activeElement);
    const way = {ArrowDown: 1, ArrowUp: -1}[event.key];
    if (way) items[(place + way + items.length) % items.length].focus();
    else if (event.key === "Escape") { this.shut(); this.app.stage.canvas.focus(); } else return;
    event.preventDefault();
    event.stopPropagation();
  }

  open(hit, at, [x, y]) {
    const {app, box} = this;
    if (hit) app.selectThing(hit);
    const rows = (hit ? this.ofPart(hit) : this.ofSheet(at)).map(([id, icon, text, act]) => make("button", {
      type: "button", role: "menuitem", "data-testid": `context-${id}`, onclick: () => { this.shut(); act(); },
    }, glyph(icon), make("span", {text})));
    box.replaceChildren(...rows);
    box.hidden = false;
    box.style.left = `${Math.max(8, Math.min(x, window.innerWidth - box.offsetWidth - 8))}px`;
    box.style.top = `${Math.max(8, Math.min(y, window.innerHeight - box.offsetHeight - 8))}px`;
    rows[0].focus();
  }

  ofPart(hit) {
    const {app} = this, {stage} = app, {name, body} = stage.scene.things[hit.thing];
    const anchored = hit.anchor !== null, pinned = anchored && stage.scene.statements.some(({pin}) => pin && pin[0] === hit.thing && Object.keys(stage.scene.things[hit.thing].anchors)[pin[1]] === hit.anchor);
    return [
      ["why", "help", `Why is ${hit.name} there?`, () => app.panel.ask("why", hit.name)],
      ["formula", "info", "Its formula", () => app.panel.ask("formula", hit.name)],
      ["plot", "plot", "Plot it", () => app.plots.add(anchored ? hit.name : `${name}.angle`)],
      ...(anchored ? [["fix", "fix", pinned ? `Free ${hit.name}` : `Fix ${hit.name}`, () => app.useTool("fix", [hit.name], [hit.at])],
        ["trace", "trace", "Trace it", () => app.useTool("trace", [hit.name], [])]] : []),
      ...(body && !anchored ? [["turn", "turn", `Turn ${name}`, () => { app.playNext = true; app.useTool("turn", [name], []); }]] : []),
      ...(body ? [["copy", "copy", `Copy ${name}`, () => app.panel.arrange("copy")]] : []),
      ["delete", "delete", `Delete ${name}`, () => app.useTool("delete", [name], [])],
    ];
  }

  ofSheet(at) {
    const {app} = this;
    return [
      ["anchor", "anchor", "A point here", () => app.useTool("anchor", [""], [at.map((value) => Math.round(value))])],
      ["fit", "fit", "The whole picture", () => app.stage.fit()],
      ["ghost", "ghost", "A ghost of this pose", () => app.controls.ghost("here")],
      ["copy", "copy", "Copy the picture", () => app.copies.copyPng()],
    ];
  }
}
