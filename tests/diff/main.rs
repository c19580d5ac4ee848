//! What a comparison of two versions says: laws, and each edit of a light by itself.

mod edits;
mod laws;
mod links;
mod responses;
mod shapes;
mod street;
