//! What all instances with one description share.

use std::sync::{Arc, Mutex, PoisonError, Weak};

use crate::description::{Causality, LAYER_LOG_CATEGORIES, ModelDescription, Variable};
use crate::lookup::Lookup;

/// A description, and what the layer reads from it once.
#[derive(Debug)]
pub(super) struct Declared {
    pub(super) table: Arc<ModelDescription>,
    pub(super) guid: String,
    pub(super) lookup: Lookup,
    /// Time, where the table has it.
    pub(super) independent: Option<usize>,
    /// For each variable: is it an input that may be set while the simulation runs?
    pub(super) is_running_input: Vec<bool>,
    /// For each variable: is it a continuous state?
    pub(super) is_state: Vec<bool>,
    /// For each variable: is it an unknown of initialisation mode?
    pub(super) is_initial_unknown: Vec<bool>,
    /// Names of all log categories.
    pub(super) log_categories: Arc<[String]>,
}

/// Those that instances have now.
static LIVE: Mutex<Vec<Weak<Declared>>> = Mutex::new(Vec::new());

impl Declared {
    /// What is shared by all instances whose models give this very table.
    pub(super) fn of(table: &Arc<ModelDescription>) -> Arc<Self> {
        let mut live = LIVE.lock().unwrap_or_else(PoisonError::into_inner);
        live.retain(|declared| declared.strong_count() > 0);
        let known = live.iter().filter_map(Weak::upgrade).find(|declared| Arc::ptr_eq(&declared.table, table));
        known.unwrap_or_else(|| {
            let declared = Arc::new(Self::new(table));
            live.push(Arc::downgrade(&declared));
            declared
        })
    }

    fn new(table: &Arc<ModelDescription>) -> Self {
        let flags = |indices: &mut dyn Iterator<Item = usize>| {
            let mut flags = vec![false; table.variables.len()];
            indices.for_each(|index| flags[index] = true);
            flags
        };
        let running_input = |v: &Variable| v.causality == Causality::Input && v.settable_while_stepping();
        let layer = LAYER_LOG_CATEGORIES.iter().map(|(name, _)| (*name).into());
        let own = table.log_categories.iter().map(|category| category.name.clone());
        Self {
            guid: table.guid(),
            lookup: Lookup::new(table),
            independent: table.variables.iter().position(|v| v.causality == Causality::Independent),
            is_running_input: table.variables.iter().map(running_input).collect(),
            is_state: flags(&mut table.states()),
            is_initial_unknown: flags(&mut table.initial_unknowns()),
            log_categories: layer.chain(own).collect(),
            table: Arc::clone(table),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_table_is_read_once_and_forgotten_with_its_last_instance() {
        let table = Arc::new(ModelDescription::new("Model", "Model"));
        let first = Declared::of(&table);
        assert!(Arc::ptr_eq(&first, &Declared::of(&table)));
        let equal = Arc::new(ModelDescription::clone(&table));
        assert!(!Arc::ptr_eq(&first, &Declared::of(&equal)), "another table, though it says the same");
        let gone = Arc::downgrade(&first);
        drop(first);
        assert!(gone.upgrade().is_none());
    }
}
