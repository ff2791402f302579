// Any channel against time, of those that this file holds.

function channelNames() {
  return Object.entries(data.messages).flatMap(([key, message]) => Object.keys(message.f).map((name) => `${key}.${name}`));
}

function makePicker() {
  const inside = document.getElementById("picked");
  const list = document.getElementById("channel");
  const search = document.getElementById("search");
  let last = null;

  const fill = () => {
    const words = search.value.toLowerCase().split(/\s+/);
    list.replaceChildren();
    let group = null, key = null;
    for (const name of channelNames()) {
      if (!words.every((word) => name.toLowerCase().includes(word))) continue;
      const [own] = keyOf(name);
      if (own !== key) {
        key = own;
        group = element("optgroup");
        const message = data.messages[own];
        group.label = message.k < message.n ? `${own}: ${message.k} samples of ${message.n} records` : `${own}: all ${message.n} records`;
        list.append(group);
      }
      const option = element("option", name);
      option.value = name;
      group.append(option);
    }
  };

  const draw = (names) => {
    const units = [...new Set(names.map((name) => channel(name).unit))];
    const curves = names.map((name, ink) => ({ label: `${name}${units.length > 1 && channel(name).unit ? `, ${channel(name).unit}` : ""}`, look: "line", ink, channel: name, stepped: channel(name).stepped }));
    const figure = element("figure", undefined, "on");
    const title = names.length > 1 ? names.join(", ") : names[0];
    figure.append(element("figcaption", units.length === 1 && units[0] ? `${title}, ${units[0]}` : title));
    const made = makePlot(figure, { title, unit: units.length === 1 ? units[0] : "", curves }, flightClock, 190);
    addTools(figure, made);
    return { names, figure, made };
  };

  const remove = (one) => { plots.splice(plots.indexOf(one.made), 1); one.made.plot.destroy(); one.made.plot = null; one.figure.remove(); };

  const add = (isFresh) => {
    const name = list.value;
    if (!name) return;
    const names = isFresh || !last ? [name] : [...new Set([...last.names, name])];
    // a plot is laid out when it is made, so its figure must stand in the page by then
    const holder = element("div");
    if (!isFresh && last) { last.figure.parentNode.after(holder); remove(last); } else inside.append(holder);
    last = draw(names);
    holder.append(last.figure);
    last.made.resize();
  };

  search.addEventListener("input", fill);
  document.getElementById("add").addEventListener("click", () => add(false));
  document.getElementById("fresh").addEventListener("click", () => add(true));
  document.getElementById("clear").addEventListener("click", () => { for (const made of plots.filter((one) => inside.contains(one.live))) plots.splice(plots.indexOf(made), 1); inside.replaceChildren(); last = null; });
  fill();
}
