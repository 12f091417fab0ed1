//! Hypotheses: what each effect would add to a fit, from which values it is looked for, and what it has in common with
//! others.

pub(crate) mod along;
pub(crate) mod beside;
pub(crate) mod candidates;
pub(crate) mod containing;
pub(crate) mod correction;
pub(crate) mod drum;
pub(crate) mod elasticity;
pub(crate) mod ends;
pub(crate) mod extension;
pub(crate) mod facts;
pub(crate) mod friction;
pub(crate) mod late;
pub(crate) mod limits;
pub(crate) mod parameter;
pub(crate) mod sensor;
pub(crate) mod signature;
mod slow;
pub(crate) mod spectrum;
pub(crate) mod stood_for;
pub(crate) mod stream;
pub(crate) mod survey;
pub(crate) mod term;
pub(crate) mod typical;
