//! Simulated inclinometers, written from the vendors' documents with their own byte handling, so that a
//! mistake in `clino-codec` cannot hide behind the same mistake here.

pub mod node;
