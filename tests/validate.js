// Validates glTF files with Khronos' validator: node tests/validate.js FOLDER-OF-NODE_MODULES FILE...
// Prints each error and warning, then a line with the numbers; exits with 1 if there is one.
const fs = require("fs");
const path = require("path");
const { createRequire } = require("module");

const [modules, ...files] = process.argv.slice(2);
const validator = createRequire(path.resolve(modules, "node_modules", "x"))("gltf-validator");

async function main() {
  let [errors, warnings] = [0, 0];
  for (const file of files) {
    const external = (uri) => fs.promises.readFile(path.resolve(path.dirname(file), decodeURIComponent(uri)));
    const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)), {
      uri: path.basename(file),
      externalResourceFunction: async (uri) => new Uint8Array(await external(uri)),
      maxIssues: 0,
    });
    errors += report.issues.numErrors;
    warnings += report.issues.numWarnings;
    for (const issue of report.issues.messages.filter((issue) => issue.severity < 2)) {
      console.log(`${file}: ${issue.code} ${issue.message} ${issue.pointer ?? ""}`);
    }
  }
  console.log(`${files.length} files, ${errors} errors, ${warnings} warnings`);
  process.exitCode = errors + warnings > 0 || files.length === 0 ? 1 : 0;
}

main();
