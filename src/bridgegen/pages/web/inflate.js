// Reads what the page holds deflated, see packed.py.

import { data } from "./data.js";

export async function inflated(text) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// A chunk's playbacks, with the roads that come with them, as those of the page's own.
export function taken({ playbacks, roads, pictures }) {
  const first = data.roads.length;
  data.roads.push(...roads);
  for (const one of playbacks) {
    if (one.road < 0) one.road = first - 1 - one.road;
    one.pictures = pictures;
  }
  return playbacks;
}

export class Packed {
  constructor({ chunk, evaluations, texts }) {
    this.chunk = chunk;
    this.texts = texts;
    this.at = new Map(evaluations.map((evaluation, k) => [evaluation, k]));
    this.chunks = new Map(); // number → what it holds, or will hold
  }

  has(evaluation) {
    return this.at.has(evaluation);
  }

  async get(evaluation) {
    const k = this.at.get(evaluation), chunk = Math.floor(k / this.chunk);
    if (!this.chunks.has(chunk)) this.chunks.set(chunk, this.read(chunk));
    return (await this.chunks.get(chunk))[k % this.chunk];
  }

  async read(chunk) {
    const text = new TextDecoder().decode(await inflated(this.texts[chunk]));
    this.texts[chunk] = null;
    return taken(JSON.parse(text));
  }
}
