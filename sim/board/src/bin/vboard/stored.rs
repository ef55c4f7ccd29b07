//! The flash contents of the firmware, kept in a file from one run to the next.

use std::fs;
use std::io::ErrorKind;
use std::path::Path;

use clino_board::Board;
use clino_board::elf::Image;

/// The image with what the file contains in its sectors; as it is when there is no such file yet.
pub fn put_into(image: Image, path: &Path) -> Result<Image, String> {
    match fs::read(path) {
        Ok(contents) => image.with_stored(&contents).map_err(|why| format!("{}: {why}", path.display())),
        Err(why) if why.kind() == ErrorKind::NotFound => Ok(image),
        Err(why) => Err(format!("{}: {why}", path.display())),
    }
}

/// Keeps what is in the sectors now.
pub fn keep(board: &Board, path: &Path) -> Result<(), String> {
    fs::write(path, board.stored()).map_err(|why| format!("{}: {why}", path.display()))
}
