//! Cases from the literature and from other programs, each named by its source.

mod ernst_1965;
mod gosselin_grenier_2011;
mod irvine_1981;
mod moorpy;
mod pott_2018;
mod rayleigh_1877;
