//! What is typed, and what comes back.

mod desk;
mod orders;
mod people;
mod programs;
mod slots;
mod starts;
