"use strict";

// Elements by name, attributes and children; text becomes text, never markup.

const SVG_SPACE = "http://www.w3.org/2000/svg";

const fillElement = (element, attributes, children) => {
  for (const [name, value] of Object.entries(attributes)) {
    if (value !== null && value !== undefined && value !== false) element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children.filter((child) => child !== null && child !== undefined));
  return element;
};

const html = (name, attributes = {}, ...children) => fillElement(document.createElement(name), attributes, children);

const svg = (name, attributes = {}, ...children) =>
  fillElement(document.createElementNS(SVG_SPACE, name), attributes, children);

const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

/** A number as the report writes it: separators, a real minus, and so many decimals at most. */
const numberText = (value, decimals = 0) => {
  const text = value.toLocaleString("en-US", { maximumFractionDigits: decimals });
  return text === "-0" ? "0" : text.replace("-", "−");
};

/** The data that stand in the script element after an element. */
const dataAfter = (element) => {
  let next = element.nextElementSibling;
  while (next && next.type !== "application/json") next = next.nextElementSibling;
  return next ? JSON.parse(next.textContent) : null;
};
