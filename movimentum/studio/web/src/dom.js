/* Elements without markup: whatever a script names a thing, it is only ever text. */
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

/* A button of a toolbar; after the mouse, keys go on to where they were. */
export function button(bar, testid, text, title, act, more = {}) {
  const made = make("button", {type: "button", "data-testid": testid, text, title, "aria-label": title, ...more});
  made.addEventListener("click", (event) => { act(event); if (event.detail > 0) made.blur(); });
  bar.append(made);
  return made;
}

/* A button that is on or off. */
export function toggle(bar, testid, text, title, on, act) {
  const made = button(bar, testid, text, title, () => {
    const pressed = made.getAttribute("aria-pressed") !== "true";
    made.setAttribute("aria-pressed", String(pressed));
    act(pressed);
  }, {"aria-pressed": String(on)});
  return made;
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

/* Little-endian 32-bit floats, as base64. */
export function littleFloats(text) {
  const view = new DataView(Uint8Array.from(atob(text), (character) => character.charCodeAt(0)).buffer);
  return Float32Array.from({length: view.byteLength / 4}, (_, k) => view.getFloat32(4 * k, true));
}
