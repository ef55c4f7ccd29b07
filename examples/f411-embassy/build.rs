//! Puts `memory.x` where the linker finds it.
use std::{env, fs, path::Path};

fn main() {
    let out = env::var("OUT_DIR").unwrap();
    fs::copy("memory.x", Path::new(&out).join("memory.x")).unwrap();
    println!("cargo:rustc-link-search={out}\ncargo:rerun-if-changed=memory.x");
}
