//! Orders have an order: a real gateway with simulated sensors, and orders at any time.

mod model;
mod sequence;
mod site;
