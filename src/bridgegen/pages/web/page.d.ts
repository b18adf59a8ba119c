// What the page's modules find beside the browser's own, for their type check (jsconfig.json).

interface Window {
  bridgegen: any;
}

interface DocumentEventMap {
  filters: CustomEvent; // detail: ranges by column
  shown: CustomEvent; // detail: the evaluation in the player
  grown: CustomEvent; // of a page that is served: there are more rows
}
