//! Forces that enter the model as they are.

/// Whether a law is a force that depends on nothing of the state, or enters as a term, so that its signature says all of it.
pub(crate) fn enters_as_it_is(id: &str) -> bool {
    matches!(id, "expression" | "periodic_gust" | "steady_wind")
}
