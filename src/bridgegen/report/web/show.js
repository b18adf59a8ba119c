// The page of one file's picture.

const payload = JSON.parse($("data").textContent);
new Picture($("layers"), payload).show(payload.pictures[0]);
