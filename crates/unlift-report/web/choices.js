// The menus of charts, 3D view and pictures. Each menu narrows the next one, so every choice is a row of
// the results.
"use strict";
window.Unlift = window.Unlift || {};

(() => {
  /** Makes an element with children; text never passes through innerHTML. */
  function element(tag, attributes = {}, ...children) {
    const node = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
    node.append(...children);
    return node;
  }

  const distinct = (items) => [...new Set(items)];
  /** Options with more letters than this become a list instead of buttons. */
  const MOST_LETTERS = 60;

  /** The groups of neighborhoods, in the order of menus. */
  const GROUPS = {
    released: "Today, from the released data alone",
    given: "Given lists of neighbors",
    oracle: "If this share of neighbors were known",
  };

  /** Makes a row of buttons, one of which is chosen. Options are {value, label}. */
  function buttons(id, name, options, chosen, changed) {
    const box = element("div", { class: "choices" });
    for (const { value, label } of options) {
      const input = element("input", { type: "radio", name: id, value: String(value) });
      input.checked = value === chosen;
      input.addEventListener("change", () => changed(value));
      box.append(element("label", {}, input, element("span", {}, label)));
    }
    return element("fieldset", {}, element("legend", {}, name), box);
  }

  /** Makes a drop-down list, with groups if options have one. */
  function list(id, name, options, chosen, changed) {
    const select = element("select", { name: id });
    const groups = new Map();
    for (const { value, label, group } of options) {
      const option = element("option", { value: String(value) }, label);
      option.selected = value === chosen;
      if (!group) { select.append(option); continue; }
      if (!groups.has(group)) {
        groups.set(group, element("optgroup", { label: GROUPS[group] ?? group }));
        select.append(groups.get(group));
      }
      groups.get(group).append(option);
    }
    select.addEventListener("change", () => changed(options.find((o) => String(o.value) === select.value).value));
    return element("label", {}, element("span", { class: "name" }, name), select);
  }

  /** Makes buttons if options are few and short, else a list; nothing for a single option. */
  function menu(id, name, options, chosen, changed) {
    if (options.length < 2) return [];
    const letters = options.reduce((sum, { label }) => sum + label.length, 0);
    const long = letters > MOST_LETTERS || options.some(({ group }) => group);
    return [(long ? list : buttons)(id, name, options, chosen, changed)];
  }

  function check(name, checked, changed) {
    const input = element("input", { type: "checkbox" });
    input.checked = checked;
    input.addEventListener("change", () => changed(input.checked));
    return element("label", { class: "check" }, input, name);
  }

  /** Adds a single menu, which sets `state[key]`. */
  function single(form, state, key, name, options, changed) {
    form.append(...menu(`${form.id}-${key}`, name, options, state[key], (value) => { state[key] = value; changed(); }));
  }

  class Chain {
    /**
     * `fields` are {key, name, option(value, items)}, from the first menu to the last; `option` gives
     * {label, group, order}. `first` has the initial values, by key.
     */
    constructor(form, fields, first, changed) {
      this.form = form;
      this.fields = fields;
      // `wanted` keeps a choice that one scheme does not offer, so that the next scheme can restore it.
      this.wanted = { ...first };
      this.state = {};
      this.changed = changed;
      this.box = element("div", { class: "chain" });
      form.append(this.box);
    }

    /** Sets the items to choose from; every item has the keys of all fields. */
    of(items) {
      this.all = items;
      this.update();
    }

    update() {
      const focused = this.box.contains(document.activeElement) ? document.activeElement.name : null;
      let items = this.all;
      const nodes = [];
      for (const { key, name, option } of this.fields) {
        const options = distinct(items.map((item) => item[key])).map((value) => {
          const those = items.filter((item) => item[key] === value);
          return { value, ...option(value, those) };
        });
        options.sort((a, b) => (a.order ?? 0) - (b.order ?? 0));
        const has = (value) => options.some((one) => one.value === value);
        const value = has(this.wanted[key]) ? this.wanted[key] : options[0]?.value;
        this.state[key] = value;
        items = items.filter((item) => item[key] === value);
        nodes.push(...menu(`${this.form.id}-${key}`, name, options, value, (chosen) => {
          this.wanted[key] = chosen;
          this.update();
        }));
      }
      this.items = items;
      this.box.replaceChildren(...nodes);
      if (focused) this.box.querySelector(`[name="${focused}"]:checked, select[name="${focused}"]`)?.focus();
      this.changed(this);
    }
  }

  /** Returns the fields of rows of the results; labels come from the rows that can be chosen. */
  function fieldsOf(data) {
    const groups = Object.keys(GROUPS);
    return {
      scheme: { key: "scheme", name: "Scheme", option: (s) => ({ label: data.schemes[s].name, order: s }) },
      given: {
        key: "given",
        name: "Neighbors",
        option: (g, rows) => {
          const given = data.givens[g];
          const labels = distinct(rows.map((row) => row.label));
          const order = groups.indexOf(given.group) * data.givens.length + g;
          return { label: labels.length === 1 ? labels[0] : given.label, group: given.group, order };
        },
      },
      solver: { key: "solver", name: "Solver", option: (s) => ({ label: data.solvers[s], order: s }) },
    };
  }

  Object.assign(window.Unlift, { element, distinct, single, check, Chain, fieldsOf });
})();
