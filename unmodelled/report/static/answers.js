"use strict";

// two ticked answers side by side; of three, the first one that was ticked is left out
function comparison() {
  const answers = JSON.parse(document.getElementById("answers-data").textContent);
  const target = document.getElementById("compared");
  const button = document.getElementById("chosen");
  const empty = target.firstElementChild;
  const boxes = [...document.querySelectorAll("[data-answer]")];
  let ticked = [];

  const apart = (a, b) => Boolean(a && b) && (a[1] < b[0] || b[1] < a[0]);

  function row(name, names, left, right) {
    const made = document.createElement("tr");
    const differs = apart(left?.interval, right?.interval);
    made.append(element("th", name, { scope: "row" }));
    [left, right].forEach((side, k) => made.append(element("td", side ? side.text : "–", { "data-label": names[k] })));
    const said = element("td", "");
    if (differs) said.append(element("span", "intervals apart", { class: "verdict fails" }));
    made.append(said);
    made.classList.toggle("apart", differs);
    return made;
  }

  function table(left, right) {
    const made = element("table", "", { class: "stack" });
    const head = made.createTHead().insertRow();
    for (const text of ["", left.name, right.name, "95 % intervals"]) head.append(element("th", text, { scope: "col" }));
    const body = made.createTBody();
    const names = [...new Set([...left.rows, ...right.rows].map((r) => r.name))];
    const found = (one, name) => one.rows.find((r) => r.name === name);
    for (const name of names) body.append(row(name, [left.name, right.name], found(left, name), found(right, name)));
    return made;
  }

  function show() {
    button.textContent = ["Tick two answers to compare", "Tick one more answer", "See the comparison"][ticked.length];
    if (ticked.length < 2) return target.replaceChildren(empty);
    const scroll = element("div", "", { class: "card scroll compared", role: "region", "aria-label": "Comparison", tabindex: "0" });
    scroll.append(table(...ticked.map((k) => answers[k])));
    return target.replaceChildren(scroll);
  }

  for (const box of boxes) {
    box.checked = false; // some browsers keep ticks when a page is opened again
    box.addEventListener("change", () => {
      const number = Number(box.dataset.answer);
      ticked = [...ticked.filter((k) => k !== number), ...(box.checked ? [number] : [])].slice(-2);
      for (const other of boxes) other.checked = ticked.includes(Number(other.dataset.answer));
      show();
    });
  }
}

comparison();
