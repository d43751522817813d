// SPDX-License-Identifier: Apache-2.0
// Builds nodes. Texts of the daemon become text nodes, never HTML: names may be hostile.
import { t, type WordKey } from "./words";

type Child = Node | string | null;

interface Props {
  class?: string;
  id?: string;
  words?: WordKey; // the text, which follows the language
  label?: WordKey; // the aria-label, which follows the language
  attributes?: Record<string, string>;
  onClick?: (event: MouseEvent) => void;
}

export function el<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  props: Props = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const node = document.createElement(tag);
  if (props.class) node.className = props.class;
  if (props.id) node.id = props.id;
  if (tag === "button") node.setAttribute("type", "button");
  for (const [name, value] of Object.entries(props.attributes ?? {}))
    node.setAttribute(name, value);
  if (props.words) {
    node.dataset.words = props.words;
    node.textContent = t(props.words);
  }
  if (props.label) {
    node.dataset.label = props.label;
    node.setAttribute("aria-label", t(props.label));
  }
  if (props.onClick) node.addEventListener("click", props.onClick as EventListener);
  for (const child of children) if (child !== null) node.append(child);
  return node;
}

// Words that the daemon or a person wrote: their language is not the page's, and characters that
// turn the direction of writing act within them alone.
export function foreign(text: string, className = ""): HTMLSpanElement {
  return el("span", { class: className, attributes: { lang: "en", dir: "auto" } }, text);
}

// Changes the texts of all nodes that follow the language.
export function sayAgain(): void {
  for (const node of document.querySelectorAll<HTMLElement>("[data-words]")) {
    node.textContent = t(node.dataset.words as WordKey);
  }
  for (const node of document.querySelectorAll<HTMLElement>("[data-label]")) {
    node.setAttribute("aria-label", t(node.dataset.label as WordKey));
  }
}

const keyOf = (node: Element) =>
  node.querySelector<HTMLElement>("[data-key]")?.dataset.key ?? "";

// Makes `children` the children of a list. One that is as before stays the node that it was, so
// that a click that has begun on it is not lost: what a button does must follow from what is seen
// of it and from its data-key. The focus goes to the node with the same data-key.
export function refill(parent: HTMLElement, children: Element[]): void {
  const active = document.activeElement;
  const held = active instanceof HTMLElement && parent.contains(active) ? active.dataset.key : null;
  const before = new Map([...parent.children].map((node) => [keyOf(node), node]));
  const wanted = children.map((node) => {
    const key = keyOf(node);
    const old = key === "" ? null : before.get(key);
    return old?.isEqualNode(node) ? old : node;
  });
  const stays = new Set(wanted);
  for (const node of [...parent.children]) if (!stays.has(node)) node.remove();
  let at = parent.firstElementChild;
  for (const node of wanted) {
    if (node === at) at = at.nextElementSibling;
    else parent.insertBefore(node, at);
  }
  if (!held || document.activeElement === active) return;
  const heir = parent.querySelector<HTMLElement>(`[data-key="${CSS.escape(held)}"]`);
  heir?.focus({ preventScroll: true });
}

// "N more" of a list that is long; null where there is nothing more.
export function moreButton(rest: number, onClick: () => void): HTMLElement | null {
  if (rest <= 0) return null;
  const button = el("button", { class: "more", onClick }, t("more", { count: rest }));
  button.dataset.key = "more";
  return el("li", {}, button);
}
