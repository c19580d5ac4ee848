//! Jobs of many frames: what of a job file is refused, and how one is carried out here. What farms make of it is
//! tested beside this, in Python, where the farms are.

mod job_file;
mod refusals;
mod run;
mod signals;
