// Run a bundle's sequence.onnx over its records in Node:
//   npm install onnxruntime-web
//   node node.cjs path/to/bundle
const fs = require("fs");
const path = require("path");
const ort = require("onnxruntime-web");

async function main(bundle) {
  const about = JSON.parse(fs.readFileSync(path.join(bundle, "model.json"), "utf8"));
  ort.env.wasm.numThreads = 1;
  const session = await ort.InferenceSession.create(fs.readFileSync(path.join(bundle, "sequence.onnx")));
  const nInputs = about.inputs.length;
  let faults = 0;
  for (const name of fs.readdirSync(path.join(bundle, "verify")).filter((file) => file.startsWith("record")).sort()) {
    const lines = fs.readFileSync(path.join(bundle, "verify", name), "utf8").trim().split("\n").slice(1);
    const rows = lines.map((line) => line.split(",").map((text) => (text === "nan" ? NaN : Number(text))));
    // At rest: each channel at its level, a number or the input whose first sample it is.
    const first = Object.fromEntries(about.inputs.map((channel, i) => [channel.name, rows[0][1 + i]]));
    const rest = Object.fromEntries(
      Object.entries(about.initialisation.levels).map(([name, level]) => [name, first[level] ?? level]),
    );
    const state = new Float64Array(about.state.size);
    for (const line of about.state.lines) {
      state.fill((rest[line.channel] - line.offset) / line.scale, line.first, line.first + line.length);
    }
    for (const space of about.state.state_spaces ?? []) {
      const scaled = space.channels.map((name, i) => (rest[name] - space.offset[i]) / space.scale[i]);
      space.at_rest.forEach((row, i) => {
        const level = row.reduce((sum, number, j) => sum + number * scaled[j], space.constant[i]);
        const bound = space.bound ?? Infinity;
        state[space.first + i] = Math.min(Math.max(level, -bound), bound);
      });
    }
    const u = rows.flatMap((row) => row.slice(1, 1 + nInputs));
    const result = await session.run({
      u: new ort.Tensor("float64", Float64Array.from(u), [rows.length, 1, nInputs]),
      state: new ort.Tensor("float64", state, [1, about.state.size]),
    });
    let worst = 0;
    const nOutputs = about.outputs.length;
    rows.forEach((row, i) => {
      for (let k = 0; k < nOutputs; k++) {
        const [expected, y] = [row[1 + nInputs + k], result.y.data[i * nOutputs + k]];
        if (Number.isNaN(expected) !== Number.isNaN(y)) worst = Infinity;
        else if (!Number.isNaN(y)) worst = Math.max(worst, Math.abs(y - expected));
      }
    });
    const sameFlags = rows.every((row, i) => row[row.length - 1] === result.flags.data[i]);
    const good = worst <= 1e-9 && sameFlags;
    faults += good ? 0 : 1;
    console.log(`${name}: ${good ? "as recorded" : "NOT as recorded"}, largest difference ${worst.toExponential(1)}`);
  }
  process.exit(faults ? 1 : 0);
}

main(process.argv[2]).catch((error) => {
  console.error(error);
  process.exit(1);
});
