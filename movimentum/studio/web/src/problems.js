/* What is wrong, with buttons that mend it. */
import {make} from "./dom.js";
import {inline} from "./panel.js";

const meanings = new Map(), open = new Set(); // by code; what is open stays open while somebody types

/* The code of a message, and what it means when it is opened. */
function meaning(code, mean) {
  const text = make("pre", {text: meanings.get(code) || "…"});
  const box = make("details", {class: "meaning", "data-testid": `meaning-${code}`}, make("summary", {text: code, title: "What this message means, and what to do"}), text);
  const fill = async () => {
    if (!meanings.has(code)) {
      const told = await mean(code);
      if (told === null) return; // the text has changed: the message comes again, and asks again
      meanings.set(code, told);
    }
    text.textContent = meanings.get(code);
  };
  box.open = open.has(code);
  box.addEventListener("toggle", () => { if (box.open) { open.add(code); fill(); } else open.delete(code); });
  return box;
}

export function showProblems(place, diagnostics, {go, fix, poses, mean, settled, calm}) {
  let number = 0;
  const rows = diagnostics.map((item) => {
    const where = item.line === null ? "" : `line ${item.line}`;
    const row = make("div", {class: `problem ${item.severity}`},
      make("button", {type: "button", class: "go", title: "Go to this place", onclick: () => go(item)},
        make("b", {text: item.severity}), make("span", {class: "where", text: where}), make("span", {}, ...inline(item.message))),
      ...item.notes.map((note) => make("p", {}, ...inline(note))));
    const fixes = item.fixes || [];
    const titles = new Set(fixes.map((each) => each.title));
    for (const help of item.helps) if (!titles.has(help)) row.append(make("p", {}, ...inline(`help: ${help}`)));
    for (const each of fixes) {
      row.append(make("button", {type: "button", class: "fix", "data-testid": `fix-${number}`, onclick: () => fix(each)}, make("span", {}, ...inline(each.title))));
      number += 1;
    }
    if (item.code === "constraint/ambiguous") {
      row.append(make("button", {type: "button", class: "fix", "data-testid": "poses", text: "show all poses", onclick: poses}));
    }
    if (item.code) row.append(meaning(item.code, mean));
    return row;
  });
  const words = diagnostics.length ? "" : settled ? calm : "";
  place.replaceChildren(...rows, ...(words ? [make("p", {class: "calm", text: words})] : []));
}
