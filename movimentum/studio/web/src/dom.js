/* Elements without markup: whatever a script names a thing, it is only ever text. */
import {ICONS} from "./icons.js";

export function make(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name === "text") made.textContent = value;
    else if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (value === true) made.setAttribute(name, "");
    else if (value !== false && value !== null && value !== undefined) made.setAttribute(name, value);
  }
  made.append(...children);
  return made;
}

export const byId = (id) => document.getElementById(id);

/* An icon, for the eyes alone. */
export function glyph(name) {
  const {namespaceURI} = byId("glyph");
  const drawn = document.createElementNS(namespaceURI, "svg"), path = document.createElementNS(namespaceURI, "path");
  drawn.setAttribute("viewBox", "0 0 24 24");
  drawn.setAttribute("aria-hidden", "true");
  drawn.classList.add("icon");
  path.setAttribute("d", ICONS[name]);
  drawn.append(path);
  return drawn;
}

/* Another icon, or another text, on a button. */
export function face(made, icon, text = "") {
  made.replaceChildren(...(icon ? [glyph(icon)] : []), ...(text ? [make("span", {text})] : []));
}

/* A button of a toolbar; after the mouse, keys go on to where they were. */
export function button(bar, testid, text, title, act, {icon = "", ...more} = {}) {
  const made = make("button", {type: "button", "data-testid": testid, title, "aria-label": title, ...more});
  face(made, icon, text);
  made.addEventListener("click", (event) => { act(event); if (event.detail > 0) made.blur(); });
  bar.append(made);
  return made;
}

/* A button that is on or off. */
export function toggle(bar, testid, text, title, on, act, more = {}) {
  const made = button(bar, testid, text, title, () => {
    const pressed = made.getAttribute("aria-pressed") !== "true";
    made.setAttribute("aria-pressed", String(pressed));
    act(pressed);
  }, {"aria-pressed": String(on), ...more});
  return made;
}

/* A button with a list behind it: rows of [testid, icon, text, keys, act], or null for a line between them. */
export function menu(bar, testid, text, title, icon, rows) {
  const list = make("div", {class: "menu-list", role: "menu", hidden: true});
  const shut = () => { list.hidden = true; opener.setAttribute("aria-expanded", "false"); };
  const opener = button(bar, testid, text, title, () => {
    const open = list.hidden;
    for (const other of document.querySelectorAll(".menu-list")) other.hidden = true;
    list.hidden = !open;
    opener.setAttribute("aria-expanded", String(open));
    if (!open) return;
    list.style.left = "0";
    const over = list.getBoundingClientRect().right - (document.documentElement.clientWidth - 8);
    if (over > 0) list.style.left = `${-over}px`;
    if (opener === document.activeElement) list.querySelector("button").focus();
  }, {icon, "aria-haspopup": "menu", "aria-expanded": "false"});
  for (const row of rows) {
    if (row === null) { list.append(make("hr")); continue; }
    const [id, sign, words, keys, act] = row;
    const item = make("button", {type: "button", role: "menuitem", "data-testid": id, onclick: () => { shut(); act(); }},
      glyph(sign), make("span", {text: words}), make("kbd", {text: keys}));
    list.append(item);
  }
  list.addEventListener("keydown", (event) => {
    const items = [...list.querySelectorAll("button")], place = items.indexOf(document.activeElement);
    const way = {ArrowDown: 1, ArrowUp: -1}[event.key];
    if (way) items[(place + way + items.length) % items.length].focus();
    else if (event.key === "Escape") { shut(); opener.focus(); } else return;
    event.preventDefault();
    event.stopPropagation();
  });
  const whole = make("div", {class: "menu"}, opener, list);
  document.addEventListener("pointerdown", (event) => { if (!whole.contains(event.target)) shut(); });
  bar.append(whole);
  return whole;
}

/* Elements for a few sentences with `code`, **bold** words and lists. */
export function prose(text) {
  const line = (words) => words.split(/(`[^`]+`|\*\*[^*]+\*\*)/).filter(Boolean).map((piece) => {
    if (piece.length > 2 && piece.startsWith("`")) return make("code", {text: piece.slice(1, -1)});
    return piece.length > 4 && piece.startsWith("**") ? make("b", {text: piece.slice(2, -2)}) : piece;
  });
  const lines = text.split("\n"), items = lines.filter((each) => each.startsWith("- "));
  const said = lines.filter((each) => !each.startsWith("- ")).join(" ");
  return [...(said ? [make("p", {}, ...line(said))] : []), ...(items.length ? [make("ul", {}, ...items.map((each) => make("li", {}, ...line(each.slice(2)))))] : [])];
}

/* Whether a film is on plain paper, which may be dark: no background of another colour, no pictures. */
export function onPaper(film) {
  const channels = (film.background || "#ffffff").match(/^#(..)(..)(..)/) || (film.background || "").match(/(\d+)\D+(\d+)\D+(\d+)/);
  const light = channels && channels.slice(1).every((each) => Number.parseInt(each, film.background && !film.background.startsWith("#") ? 10 : 16) > 235);
  return Boolean(light) && !film.images.length;
}

/* Little-endian 32-bit floats, as base64. */
export function littleFloats(text) {
  const view = new DataView(Uint8Array.from(atob(text), (character) => character.charCodeAt(0)).buffer);
  return Float32Array.from({length: view.byteLength / 4}, (_, k) => view.getFloat32(4 * k, true));
}
