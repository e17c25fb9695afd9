/* Pictures that are dropped on the page, or chosen: they go beside the script, and become sprites. */
import {byId, make} from "./dom.js";

const LARGEST = 2.9e6; // bytes, in one message of 4 MiB
const SIDE = 2000; // pixels of a photo that is larger

export class Drop {
  constructor(app) {
    this.app = app;
    const room = byId("room");
    room.addEventListener("dragover", (event) => { event.preventDefault(); room.classList.add("drop"); });
    room.addEventListener("dragleave", () => room.classList.remove("drop"));
    room.addEventListener("drop", (event) => {
      event.preventDefault();
      room.classList.remove("drop");
      const [file] = event.dataTransfer.files;
      if (file) this.take(file, app.stage.fromEvent(event));
    });
    this.chooser = make("input", {type: "file", accept: "image/png,image/jpeg,image/gif,image/webp,image/svg+xml", hidden: true, "data-testid": "picture-file", "aria-label": "A picture"});
    this.chooser.addEventListener("change", () => {
      const [file] = this.chooser.files, [left, bottom, right, top] = app.stage.rect;
      if (file) this.take(file, [(left + right) / 2, (bottom + top) / 2]);
      this.chooser.value = "";
    });
    document.body.append(this.chooser);
  }

  choose() {
    this.chooser.click();
  }

  async take(file, at) {
    const {app} = this;
    if (/\.(mov|txt|linkage2|pyslvs)$/i.test(file.name)) { app.files.openText(await file.text(), file.name); return; }
    const address = URL.createObjectURL(file), image = new Image();
    image.src = address;
    try {
      await image.decode();
    } catch {
      app.hint(`${file.name} is no picture that can be shown.`);
      return;
    } finally {
      URL.revokeObjectURL(address);
    }
    const scaled = file.size > LARGEST ? await smaller(image, file.type) : null, data = scaled || file;
    if (data.size > LARGEST) { app.hint(`${file.name} is too large: make it smaller than 2.9 MB.`); return; }
    const bytes = new Uint8Array(await data.arrayBuffer()), pieces = [];
    for (let k = 0; k < bytes.length; k += 0x8000) pieces.push(String.fromCharCode(...bytes.subarray(k, k + 0x8000)));
    const named = /svg/.test(file.type) ? namesIn(await file.text(), image.naturalWidth, image.naturalHeight) : [];
    this.waiting = {named, at: at.map((value) => Math.round(value)), size: scaled ? scaled.pixels : [image.naturalWidth, image.naturalHeight], words: scaled ? `The photo was made smaller: ${scaled.pixels.join(" by ")} pixels. ` : ""};
    if (!app.send({kind: "picture", called: file.name, data: btoa(pieces.join(""))})) app.hint("Not added: there is no connection.");
  }

  /* It is beside the script: now it is in it. What it names inside is offered for its anchors. */
  stored({called, words}) {
    const {app, waiting} = this;
    this.waiting = null;
    if (words) { app.hint(words); return; }
    if (!waiting) return;
    this.words = waiting.words;
    const put = (chosen) => app.useTool("picture", [called, ...chosen.map(([name]) => name)], [waiting.at, waiting.size, ...chosen.map(([, x, y]) => [x, y])]);
    if (!waiting.named.length) { put([]); this.next(); return; }
    const rows = waiting.named.map(([name, x, y]) => make("label", {}, make("span", {text: name}), make("input", {type: "checkbox", checked: true, "data-testid": `id-${name}`, "data-point": JSON.stringify([name, x, y])})));
    app.files.dialog("Anchors of the picture", [make("p", {class: "calm", text: "The drawing names these. Which are to be points?"}), ...rows], (place) => {
      const chosen = rows.map((row) => row.querySelector("input")).filter((input) => input.checked).map((input) => JSON.parse(input.dataset.point));
      place.close();
      put(chosen);
      this.next();
    }, "Add");
  }

  next() {
    this.app.controls.choose("anchor");
    this.app.hint(`${this.words}Click on the picture to give it points.`);
  }
}

/* A photo with fewer pixels; `pixels`: how many across and down. */
async function smaller(image, type) {
  const scale = Math.min(1, SIDE / Math.max(image.naturalWidth, image.naturalHeight));
  const canvas = make("canvas");
  canvas.width = Math.round(scale * image.naturalWidth);
  canvas.height = Math.round(scale * image.naturalHeight);
  canvas.getContext("2d").drawImage(image, 0, 0, canvas.width, canvas.height);
  const blob = await new Promise((done) => { canvas.toBlob(done, type === "image/png" ? type : "image/jpeg", 0.85); });
  return Object.assign(blob, {pixels: [canvas.width, canvas.height]});
}

const MOST_NAMES = 40;

/* [name, x, y] of what a drawing has a name for: the middle of it, in pixels from the lower left corner. */
function namesIn(text, wide, high) {
  const root = new DOMParser().parseFromString(text, "image/svg+xml").documentElement;
  if (root.localName !== "svg") return [];
  for (const element of [...root.querySelectorAll("script, style, foreignObject, image, use, a")]) element.remove(); // only shapes are measured
  for (const element of [root, ...root.querySelectorAll("*")]) {
    for (const {name} of [...element.attributes]) if (/^on|href|style/i.test(name)) element.removeAttribute(name);
  }
  const drawn = document.importNode(root, true), place = make("div", {class: "measuring", "aria-hidden": "true"}, drawn);
  drawn.setAttribute("width", wide);
  drawn.setAttribute("height", high);
  document.body.append(place);
  const frame = drawn.getBoundingClientRect();
  const found = [...drawn.querySelectorAll("[id]")].filter((element) => element.getBBox && !element.closest("defs, symbol, clipPath, mask, pattern"))
    .map((element) => ({name: element.id, box: element.getBoundingClientRect()}))
    .filter(({name, box}) => /[A-Za-z]/.test(name) && box.width + box.height > 0)
    .map(({name, box}) => [name, box.left + box.width / 2 - frame.left, frame.bottom - box.top - box.height / 2].map((value) => (typeof value === "number" ? Number(value.toFixed(2)) : value)));
  place.remove();
  return found.slice(0, MOST_NAMES);
}
