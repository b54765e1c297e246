// SPDX-License-Identifier: Apache-2.0
// The little that the page needs to make and change elements. Everything is built once; then only what changed is touched.

type Child = Node | string | undefined | false;
type Attributes = Record<string, string | number | boolean | ((event: never) => void) | undefined>;

/** An element with attributes (`class`, `aria-*`, ...), listeners (`onclick`) and children. */
export function el<K extends keyof HTMLElementTagNameMap>(tag: K, attributes: Attributes = {}, ...children: Child[]): HTMLElementTagNameMap[K] {
  return fill(document.createElement(tag), attributes, children);
}

export function svg<K extends keyof SVGElementTagNameMap>(tag: K, attributes: Attributes = {}, ...children: Child[]): SVGElementTagNameMap[K] {
  return fill(document.createElementNS('http://www.w3.org/2000/svg', tag), attributes, children);
}

function fill<T extends Element>(element: T, attributes: Attributes, children: Child[]): T {
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === 'function') element.addEventListener(name.slice(2), value as EventListener);
    else set(element, name, value);
  }
  element.append(...children.filter((child): child is Node | string => child !== undefined && child !== false));
  return element;
}

/** Sets an attribute; true is the bare attribute, false and undefined take it away. */
export function set(element: Element, name: string, value: string | number | boolean | undefined): void {
  if (value === undefined || value === false) {
    if (element.hasAttribute(name)) element.removeAttribute(name);
    return;
  }
  const text = value === true ? '' : String(value);
  if (element.getAttribute(name) !== text) element.setAttribute(name, text);
}

export function setText(element: Element, text: string): void {
  if (element.textContent !== text) element.textContent = text;
}

export function show(element: Element, shown: boolean): void {
  set(element, 'hidden', !shown);
}

/** Keeps one element for each item, by key, in the items' order. Those that stay keep their focus. */
export class Keyed<T, V extends {root: Element}> {
  readonly views = new Map<string, V>();

  constructor(private readonly parent: Element, private readonly make: (key: string) => V,
              private readonly update: (view: V, item: T) => void) {}

  show(items: readonly T[], key: (item: T) => string): void {
    const gone = new Set(this.views.keys());
    const focused = document.activeElement;
    let moved = false;
    items.forEach((item, place) => {
      const name = key(item);
      gone.delete(name);
      let view = this.views.get(name);
      if (!view) this.views.set(name, (view = this.make(name)));
      if (this.parent.children[place] !== view.root) {
        this.parent.insertBefore(view.root, this.parent.children[place] ?? null);
        moved = true;
      }
      this.update(view, item);
    });
    for (const name of gone) {
      this.views.get(name)?.root.remove();
      this.views.delete(name);
    }
    if (moved && focused instanceof HTMLElement && this.parent.contains(focused)) focused.focus({preventScroll: true});
  }
}
