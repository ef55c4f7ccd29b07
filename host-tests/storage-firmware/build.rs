//! Points the linker to the memory layout of the chip, which the firmware proper uses too.

fn main() {
    println!("cargo:rustc-link-search={}/../..", env!("CARGO_MANIFEST_DIR"));
    println!("cargo:rerun-if-changed=../../memory.x");
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
}
