// Unpack what the page carries compressed, in the order in which it stands there; then run the page's
// own script.

function run(code) {
  const script = document.createElement("script");
  script.textContent = code;
  document.body.append(script);
}

async function unpacked({ textContent }) {
  const bytes = Uint8Array.from(atob(textContent), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).text();
}

async function open() {
  run(await unpacked(document.getElementById("plotly")));
  for (const packed of document.querySelectorAll("script[data-packed]")) {
    packed.textContent = await unpacked(packed);
  }
  run(document.getElementById("page").textContent);
  document.body.dataset.ready = "";
}

if (window.DecompressionStream) open();
else document.getElementById("outdated").hidden = false;
