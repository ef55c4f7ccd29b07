//! Points the linker to the memory layout of the chip, which the firmware uses too, and to the scripts of the harness and the log.

fn main() {
    println!("cargo:rustc-link-search={}/..", env!("CARGO_MANIFEST_DIR"));
    println!("cargo:rerun-if-changed=../memory.x");
    println!("cargo:rustc-link-arg-tests=-Tembedded-test.x");
    println!("cargo:rustc-link-arg-tests=-Tdefmt.x");
    println!("cargo:rustc-check-cfg=cfg(rust_analyzer)");
}
