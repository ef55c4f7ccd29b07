//! The whole way from an image to its worst-case stack.

use crate::annotations::Annotations;
use crate::elf::Image;
use crate::stack::{Worst, worst};
use crate::{Error, calls, cfi, frames, instruction};

/// What the analysis of the stack says of an image.
pub struct Report {
    /// The image.
    pub image: Image,
    /// How many functions it has.
    pub functions: usize,
    /// How many of the compiler's notes on the stack agree; none disagrees.
    pub agreeing: usize,
    /// The worst case, the main program first.
    pub levels: Vec<Worst>,
}

impl Report {
    /// Analyses an image.
    ///
    /// # Errors
    /// The image cannot be followed, or it does not fit the table.
    pub fn of(elf: &[u8], annotations: &Annotations) -> Result<Report, Error> {
        let image = Image::parse(elf)?;
        let code = instruction::decode(&image)?;
        let frames = frames::all(&image, &code)?;
        let agreeing = cfi::compare(elf, &image, &frames)?;
        let graph = calls::graph(&image, &code, &frames, annotations)?;
        let levels = worst(&image, &frames, &graph, annotations)?;
        Ok(Report { functions: frames.len(), image, agreeing, levels })
    }
}
