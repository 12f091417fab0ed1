//! Cases from the literature and from other programs, each named by its source.

mod chen_2022;
mod ernst_1965;
mod gosselin_grenier_2011;
mod gouttefarde_gosselin_2006;
mod irvine_1981;
mod merlet_2012;
mod moordyn;
mod moorpy;
mod pott_2018;
mod rayleigh_1877;
