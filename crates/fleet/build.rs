//! Takes plotly.js out of the `plotly` crate, and packs it for the page.
//!
//! Cargo fetches and checks it like every other dependency, so that neither a copy lies in the repository nor a request
//! leaves the page. The crate hands it out as the text of a script element.

use std::io::Write as _;
use std::path::Path;
use std::{env, fs};

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let elements = plotly::Plot::offline_js_sources();
    let begin = elements.find('>').map(|at| at + 1).expect("a script element begins");
    // The first one: others hold type setting for formulas, which no plot here has.
    let end = elements[begin..].find("</script>").map(|at| begin + at).expect("it ends");
    let script = &elements[begin..end];
    assert!(script.contains("plotly.js"), "the first script of the crate is plotly.js");
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
    packed.write_all(script.as_bytes()).expect("into memory");
    let packed = packed.finish().expect("into memory");
    let out = env::var_os("OUT_DIR").expect("cargo sets it");
    fs::write(Path::new(&out).join("plotly.js.gz"), packed).expect("the folder of this build");
}
