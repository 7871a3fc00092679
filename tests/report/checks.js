// What a page that is open says about itself; every function returns a list of complaints.
"use strict";

window.checks = {
  // wider than the window, and not inside something that scrolls sideways
  overflows() {
    const width = document.documentElement.clientWidth;
    const found = [];
    if (document.documentElement.scrollWidth > width) found.push(`the page is ${document.documentElement.scrollWidth} wide`);
    const scrolls = (e) => e && (["auto", "scroll"].includes(getComputedStyle(e).overflowX) || scrolls(e.parentElement));
    const visible = (e) => e.checkVisibility() && e.getClientRects().length > 0;
    for (const e of document.querySelectorAll("body *")) {
      if (!visible(e) || scrolls(e.parentElement) || e.closest(".skip, svg, math")) continue;
      const box = e.getBoundingClientRect();
      if (box.right > width + 1) found.push(`${e.tagName}.${e.className} ends at ${Math.round(box.right)}: ${e.textContent.slice(0, 40)}`);
      const clipped = getComputedStyle(e).overflowX === "hidden" && e.scrollWidth > e.clientWidth + 1;
      if (clipped && e.tagName !== "DIALOG") found.push(`${e.tagName}.${e.className} is cut off: ${e.textContent.slice(0, 40)}`);
    }
    return found;
  },

  async images() {
    const found = [];
    for (const image of document.querySelectorAll("main img")) {
      image.loading = "eager";
      await image.decode().catch(() => {});
      if (!image.naturalWidth) found.push(`no image: ${image.src}`);
    }
    return found;
  },

  // text that is too small or too pale to read (WCAG AA: 4.5 to 1)
  illegible() {
    const found = new Set();
    const channel = (c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
    const colour = (text) => (text.match(/[\d.]+/g) || []).map(Number);
    const light = ([r, g, b]) => 0.2126 * channel(r / 255) + 0.7152 * channel(g / 255) + 0.0722 * channel(b / 255);
    const ground = (e) => {
      const c = e ? colour(getComputedStyle(e).backgroundColor) : [255, 255, 255];
      return c.length === 3 || c[3] === 1 ? c : ground(e.parentElement);
    };
    const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    while (walker.nextNode()) {
      const e = walker.currentNode.parentElement;
      if (!walker.currentNode.data.trim() || !e.checkVisibility() || e.closest("script, .skip, svg")) continue;
      const style = getComputedStyle(e);
      const [a, b] = [light(colour(style.color)), light(ground(e))];
      const contrast = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
      const what = `${e.tagName}.${e.className} "${walker.currentNode.data.trim().slice(0, 20)}"`;
      if (contrast < 4.5) found.add(`contrast ${contrast.toFixed(1)}: ${what}`);
      if (parseFloat(style.fontSize) < 11 && !e.closest("math")) found.add(`${style.fontSize}: ${what}`);
    }
    return [...found];
  },

  // figures without the command that makes them
  commands() {
    return [...document.querySelectorAll("main figure")]
      .filter((f) => !f.querySelector(".command code")?.textContent.startsWith("python -m pipeline"))
      .map((f) => `no command: ${f.id}`);
  },

  links() {
    return [...document.querySelectorAll("[href], [src]")].map((e) => e.href || e.src).filter((url) => !url.startsWith("data:"));
  },

  ids() {
    return [...document.querySelectorAll("[id]")].map((e) => e.id);
  },
};
