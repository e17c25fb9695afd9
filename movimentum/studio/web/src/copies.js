/* The still on show: to the clipboard as PNG or SVG, to a file as PNG. */
import {make} from "./dom.js";

const FINE = 2; // pixels of the copy to one of the film, at least

export class Copies {
  constructor(app) {
    this.app = app;
    this.wanted = null;
  }

  /* The film's own picture, without what the page lays over it. */
  still() {
    const {picture} = this.app.stage;
    if (!picture) return null;
    const fine = Math.max(FINE, window.devicePixelRatio || 1);
    const canvas = make("canvas");
    canvas.width = Math.max(1, Math.round(picture.film.width * fine));
    canvas.height = Math.max(1, Math.round(picture.film.height * fine));
    picture.paintOn(canvas);
    return canvas;
  }

  blobOf(canvas) {
    return new Promise((done, failed) => { canvas.toBlob((blob) => (blob ? done(blob) : failed(new Error("too large"))), "image/png"); });
  }

  copyPng() {
    const canvas = this.still();
    if (!canvas) { this.app.hint("There is no picture yet."); return; }
    this.put({"image/png": this.blobOf(canvas)}, "The picture is on the clipboard, as PNG.", "PNG saves the picture to a file instead.");
  }

  copySvg() {
    if (!this.app.send({kind: "still", rev: this.app.shownRev, time: this.app.clock.time})) {
      this.app.hint("Not copied: there is no connection.");
      return;
    }
    const text = new Promise((done, failed) => { this.wanted = {done, failed}; });
    text.catch(() => {}); // it is told below
    const as = (type) => text.then((svg) => new Blob([svg], {type}));
    const items = {"text/plain": as("text/plain")};
    if (window.ClipboardItem && ClipboardItem.supports && ClipboardItem.supports("image/svg+xml")) items["image/svg+xml"] = as("image/svg+xml");
    this.put(items, "The picture is on the clipboard, as SVG.", "Render… writes an SVG file instead.");
  }

  told({svg, words}) {
    if (!this.wanted) return;
    const {done, failed} = this.wanted;
    this.wanted = null;
    if (svg) done(svg); else failed(new Error(words));
  }

  /* The clipboard is written to while the key or the click still counts: what is not made yet is promised. */
  async put(items, words, instead) {
    const clipboard = navigator.clipboard;
    try {
      if (clipboard && clipboard.write && window.ClipboardItem) await clipboard.write([new ClipboardItem(items)]);
      else if (clipboard && clipboard.writeText && items["text/plain"]) await clipboard.writeText(await (await items["text/plain"]).text());
      else throw new Error("this browser lets no page do that");
      this.app.hint(words);
    } catch (problem) {
      const why = problem.name === "NotAllowedError" ? "the browser does not allow it" : problem.message;
      this.app.hint(`Not copied: ${why}. ${instead}`);
    }
  }

  /* What the page shows, as a file. */
  screenshot() {
    const {canvas} = this.app.stage;
    canvas.toBlob((blob) => this.download(blob, `${this.app.files.stem()}.png`));
  }

  download(blob, name) {
    const link = make("a", {href: URL.createObjectURL(blob), download: name});
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  }
}
