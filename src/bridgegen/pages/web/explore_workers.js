// Simulators beside the page's own, each in a worker: a map is of thousands of rows.

import { Simulator } from "./simulator.js";

const MOST_WORKERS = 8;

// A page that is opened from disk has no file for a worker. The class alone makes one.
const WORKER = `${Simulator}
  let kept;
  onmessage = ({ data: { module, tables, bytes, asked }, ports }) => {
    if (module) kept = new Simulator(module, tables, bytes);
    ports[0].postMessage(asked && kept.verdicts(asked));
  };`;

function ask(worker, message) {
  return new Promise((resolve, reject) => {
    const { port1, port2 } = new MessageChannel();
    port1.onmessage = ({ data }) => { port1.close(); resolve(data); };
    worker.onerror = reject;
    worker.postMessage(message, [port2]);
  });
}

/** What gives `Simulator.verdicts` elsewhere, once for each core; none where browser or policy allows no workers. */
export async function workers({ module, tables, data: bytes }) {
  const url = URL.createObjectURL(new Blob([WORKER], { type: "text/javascript" }));
  const begin = async () => {
    const worker = new Worker(url);
    await ask(worker, { module, tables: { ...tables, kernels: null, data: null, rows: null }, bytes });
    return (asked) => ask(worker, { asked });
  };
  try {
    return await Promise.all(Array.from({ length: Math.min(navigator.hardwareConcurrency || 1, MOST_WORKERS) }, begin));
  } catch {
    return [];
  } finally {
    URL.revokeObjectURL(url);
  }
}
