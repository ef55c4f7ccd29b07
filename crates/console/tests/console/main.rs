//! What is typed, and what comes back.

mod altered;
mod desk;
mod orders;
mod people;
mod programs;
mod slots;
mod starts;
