"use strict";

const KINDS = { page: "Page", diagnosis: "Diagnosis", figure: "Figure", claim: "Claim", table: "Table", metrics: "Numbers" };
const MOST = 30;

function element(tag, text, attributes = {}) {
  const made = document.createElement(tag);
  made.textContent = text;
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  return made;
}

// theme: what the system asks for until the reader chooses
function themeButton() {
  const system = matchMedia("(prefers-color-scheme: dark)");
  document.getElementById("theme").addEventListener("click", () => {
    const now = document.documentElement.dataset.theme || (system.matches ? "dark" : "light");
    const next = now === "dark" ? "light" : "dark";
    document.documentElement.dataset.theme = next;
    try { localStorage.setItem("theme", next); } catch { /* some browsers keep nothing for files */ }
  });
}

// search: every word must occur
function searchBox() {
  const input = document.getElementById("search");
  const found = document.getElementById("found");
  const root = document.body.dataset.root;
  const block = document.getElementById("search-data");
  const entries = (block ? JSON.parse(block.textContent) : window.SEARCH || []).map((e) => ({ ...e, all: `${KINDS[e.kind]} ${e.title} ${e.text}`.toLowerCase() }));
  const href = (url) => (url.startsWith("../") && root ? url.slice(3) : root + url);
  const close = () => { found.hidden = true; };

  function show() {
    const words = input.value.toLowerCase().split(/\s+/).filter(Boolean);
    found.replaceChildren();
    found.hidden = words.length === 0;
    if (found.hidden) return;
    const hits = entries.filter((e) => words.every((w) => e.all.includes(w)));
    for (const hit of hits.slice(0, MOST)) {
      const link = element("a", hit.title, { href: href(hit.url) });
      const text = hit.text.length > 110 ? `${hit.text.slice(0, 110)}…` : hit.text;
      link.append(element("small", [KINDS[hit.kind], text].filter(Boolean).join(": ")));
      link.addEventListener("click", close);
      found.append(link);
    }
    if (hits.length === 0) found.append(element("p", "Nothing found."));
    if (hits.length > MOST) found.append(element("p", `${hits.length - MOST} more; add a word.`));
  }

  function move(event) {
    const links = [input, ...found.querySelectorAll("a")];
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (event.key === "Escape") { close(); input.focus(); }
    if (!step || found.hidden) return;
    event.preventDefault();
    const at = links.indexOf(document.activeElement);
    links[Math.min(Math.max(at + step, 0), links.length - 1)].focus();
  }

  input.addEventListener("input", show);
  input.addEventListener("focus", show);
  input.parentElement.addEventListener("keydown", move);
  document.addEventListener("click", (event) => { if (!input.parentElement.contains(event.target)) close(); });
  document.addEventListener("keydown", (event) => {
    if (event.key === "/" && !/INPUT|TEXTAREA/.test(document.activeElement.tagName)) { event.preventDefault(); input.focus(); }
  });
}

// tables: click a heading to sort, type to filter
function compare(a, b) {
  if (a === "" || b === "") return (a === "") - (b === "");
  const [x, y] = [Number(a), Number(b)];
  return Number.isNaN(x) || Number.isNaN(y) ? a.localeCompare(b, "en", { numeric: true }) : x - y;
}

function sortable(table) {
  const body = table.tBodies[0];
  const headings = [...table.tHead.rows[0].cells];
  const value = (row, i) => row.cells[i].dataset.exact ?? row.cells[i].textContent.trim();
  headings.forEach((heading, i) => {
    const button = element("button", heading.textContent, { type: "button" });
    heading.replaceChildren(button);
    button.addEventListener("click", () => {
      const down = heading.getAttribute("aria-sort") === "ascending";
      headings.forEach((other) => other.removeAttribute("aria-sort"));
      heading.setAttribute("aria-sort", down ? "descending" : "ascending");
      const rows = [...body.rows].sort((a, b) => {
        const [x, y] = [value(a, i), value(b, i)];
        // what is missing stays last both ways
        return x === "" || y === "" || !down ? compare(x, y) : compare(y, x);
      });
      body.append(...rows);
    });
  });
}

function filterable(input) {
  const section = input.closest("section");
  const rows = [...section.querySelector("tbody").rows];
  const count = section.querySelector(".count");
  const all = count.textContent;
  input.addEventListener("input", () => {
    const words = input.value.toLowerCase().split(/\s+/).filter(Boolean);
    let shown = 0;
    for (const row of rows) {
      const text = row.textContent.toLowerCase();
      row.hidden = !words.every((w) => text.includes(w));
      shown += row.hidden ? 0 : 1;
    }
    count.textContent = words.length ? `${shown} of ${all}` : all;
  });
}

// only the rows of a table with one verdict, of the full run where there is one; a second click shows all again
function verdictTiles(list) {
  const tiles = [...list.querySelectorAll("[data-show]")];
  const cell = document.querySelector(`#${list.dataset.of} td.full`) ? "td.full " : "";
  for (const tile of tiles) {
    tile.addEventListener("click", () => {
      const only = tile.hasAttribute("aria-current") ? "" : tile.dataset.show;
      for (const other of tiles) other.toggleAttribute("aria-current", other.dataset.show === only);
      for (const row of document.querySelectorAll(`#${list.dataset.of} tbody tr`)) {
        row.classList.toggle("other", Boolean(only) && !row.querySelector(`${cell}span.${only}`));
      }
    });
  }
}

// figures: enlarge, and step through those of the page; on a phone the figure scrolls at the size it was drawn
function zoom() {
  const dialog = document.getElementById("zoom");
  const [title, link, pan, image, caption] = ["strong", "a", ".pan", "img", "p"].map((what) => dialog.querySelector(what));
  const plates = [...document.querySelectorAll("[data-zoom]")];
  let at = 0;

  function show(i) {
    at = (i + plates.length) % plates.length;
    const plate = plates[at];
    title.textContent = plate.dataset.zoom;
    link.href = plate.href;
    image.src = plate.querySelector("img").src;
    image.alt = plate.querySelector("img").alt;
    caption.textContent = image.alt;
    pan.scrollTo(0, 0);
  }

  plates.forEach((plate, i) => {
    plate.addEventListener("click", (event) => {
      if (event.ctrlKey || event.metaKey || event.shiftKey) return;
      event.preventDefault();
      show(i);
      dialog.showModal();
    });
  });
  for (const button of dialog.querySelectorAll("[data-step]")) {
    button.addEventListener("click", () => show(at + Number(button.dataset.step)));
    button.hidden = plates.length < 2;
  }
  dialog.querySelector("[data-close]").addEventListener("click", () => dialog.close());
  dialog.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (step && document.activeElement !== pan) show(at + step);
  });
  dialog.addEventListener("click", (event) => { if (event.target === dialog) dialog.close(); });
}

function copyButtons() {
  if (!navigator.clipboard) return;
  for (const button of document.querySelectorAll("[data-copy]")) {
    button.hidden = false;
    button.addEventListener("click", async () => {
      try {
        await navigator.clipboard.writeText(button.previousElementSibling.textContent);
        button.textContent = "Copied";
      } catch {
        getSelection().selectAllChildren(button.previousElementSibling);
        button.textContent = "Selected";
      }
      setTimeout(() => { button.textContent = "Copy"; }, 1500);
    });
  }
}

themeButton();
searchBox();
document.querySelectorAll("main table:has(> thead)").forEach(sortable);
document.querySelectorAll("[data-filter]").forEach(filterable);
document.querySelectorAll("[data-of]").forEach(verdictTiles);
zoom();
copyButtons();
// on a phone the list of pages is one line that scrolls
document.querySelector(".side [aria-current]")?.scrollIntoView({ block: "nearest", inline: "center" });
