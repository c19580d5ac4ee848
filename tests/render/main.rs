//! Proof that pictures are right: closed forms, other renderers, and every strategy against every
//! other.

mod bounces;
mod closed_forms;
mod lens;
mod shadows;
mod stage;
mod statistics;
