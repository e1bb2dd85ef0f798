// Runs the Khronos validator over files and prints its errors and warnings, one a line. Needs the package gltf-validator.
const fs = require("fs");
const path = require("path");
const validator = require("gltf-validator");

async function report(file) {
  const beside = async (uri) =>
    new Uint8Array(fs.readFileSync(path.resolve(path.dirname(file), decodeURIComponent(uri))));
  const options = { maxIssues: 10000, externalResourceFunction: beside };
  const { issues } = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)), options);
  const kinds = ["error", "warning"];
  for (const { severity, code, pointer, message } of issues.messages) {
    if (severity < kinds.length) {
      console.log(`${kinds[severity]}: ${path.basename(file)}: ${code} ${pointer}: ${message}`);
    }
  }
  console.log(`looked at: ${path.basename(file)}`);
}

process.argv.slice(1).reduce((before, file) => before.then(() => report(file)), Promise.resolve());
