//! What captures of the board's lines tell, and pictures of them: for the virtual board's and for those of a logic analyser.
//!
//! The program beside it (`main.rs`) runs the image on a board; [`picture`] makes the figures of `docs/bring-up.md`.

pub mod capture;
pub mod measure;
pub mod picture;
