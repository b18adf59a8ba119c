// The page's address names scenario and time: "#0001@3.45", or "#evaluation-57@3.45" of one that was not exported.

export function addressOf(kept, isKept, index) {
  const name = isKept ? encodeURIComponent(kept.name) : `evaluation-${kept.evaluation + 1}`;
  return `#${name}@${Number((index * kept.time_step).toFixed(4))}`;
}

// What the address names: a name, an evaluation counted from 0 or null, seconds or null.
export function readAddress() {
  const [, text = "", time] = /^#(.+?)(?:@(\d+(?:\.\d+)?))?$/.exec(location.hash) ?? [];
  let name = text;
  try {
    name = decodeURIComponent(text);
  } catch {
    // No proper address: taken as it stands.
  }
  const [, number] = /^evaluation-(\d+)$/.exec(name) ?? [];
  return { name, evaluation: number ? Number(number) - 1 : null, seconds: time ? Number(time) : null };
}
