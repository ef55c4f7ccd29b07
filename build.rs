//! Chooses the linker scripts: of the board, if it has other memory than the default one (`memory.x`), and of the log, if
//! there is one.

use std::env;
use std::path::Path;

/// Where a board has its file and, if need be, its linker script.
const BOARDS: &str = "src/board";

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=memory.x");
    println!("cargo:rerun-if-changed={BOARDS}");
    if env::var_os("CARGO_FEATURE_DEFMT").is_some() {
        println!("cargo:rustc-link-arg-bins=-Tdefmt.x");
    }
    let root = env::var("CARGO_MANIFEST_DIR").expect("cargo sets it");
    let script = Path::new(&root).join(BOARDS).join(board()).with_extension("x");
    if script.exists() {
        println!("cargo:rustc-link-arg-bins=-T{}", script.display());
    }
    // After the board's: a name counts from where it stands.
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
}

/// Name of the board's files: its feature without `board-`.
fn board() -> String {
    let features =
        env::vars().filter_map(|(name, _)| Some(name.strip_prefix("CARGO_FEATURE_BOARD_")?.to_lowercase()));
    let boards: Vec<String> = features.collect();
    match &boards[..] {
        [board] => board.clone(),
        [] => panic!(
            "no board: without the default features, choose one, such as `--features board-f407-disc1`"
        ),
        several => {
            panic!("one board at a time, not {several:?}: `--no-default-features` leaves out the default one")
        }
    }
}
