/* The script behind the # of an address: compressed, and never sent to a server. */

const MARK = "script=";

async function through(bytes, stream) {
  return new Uint8Array(await new Response(new Blob([bytes]).stream().pipeThrough(stream)).arrayBuffer());
}

export async function packed(text) {
  const bytes = await through(new TextEncoder().encode(text), new CompressionStream("deflate-raw"));
  let letters = "";
  for (const byte of bytes) letters += String.fromCharCode(byte);
  return btoa(letters).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
}

export async function unpacked(text) {
  const letters = atob(text.replaceAll("-", "+").replaceAll("_", "/"));
  return new TextDecoder("utf-8", {fatal: true}).decode(await through(Uint8Array.from(letters, (each) => each.charCodeAt(0)), new DecompressionStream("deflate-raw")));
}

export async function link(text) {
  const address = new URL(window.location.href);
  address.hash = MARK + await packed(text);
  return address.href;
}

/* The script of an address; null if it has none. A broken one is an error. */
export async function shared(address) {
  const place = address.indexOf(`#${MARK}`);
  return place < 0 ? null : unpacked(address.slice(place + MARK.length + 1));
}
