//! What is typed, and what comes back.

mod altered;
mod desk;
mod people;
mod programs;
mod slots;
mod starts;
