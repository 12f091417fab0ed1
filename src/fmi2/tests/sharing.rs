//! What instances share, and how often a model is built.

use std::fs;
use std::path::PathBuf;
use std::sync::Arc;

use super::*;
use crate::plant::BUILT;

/// A folder with a model of its own, removed in the end.
struct Resources(PathBuf);

impl Resources {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("cdpr-{name}-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        Self(folder)
    }

    fn instance(&self, model: &str) -> CablePlatform {
        fs::write(self.0.join("model.toml"), model).unwrap();
        CablePlatform::instantiate(Some(&self.0)).unwrap()
    }
}

impl Drop for Resources {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

const FORMULA: &str = "[[effect]]\nid = \"expression\"\ntarget = \"platform.force_x\"\nexpression = \"-4711*vx\"\n";

fn built(work: impl FnOnce()) -> usize {
    let before = BUILT.get();
    work();
    BUILT.get() - before
}

#[test]
fn a_model_is_built_once_for_all_instances() {
    let resources = Resources::new("built-once");
    let mut instances = Vec::new();
    assert_eq!(built(|| instances.push(resources.instance(FORMULA))), 1);
    let more = built(|| {
        instances.push(resources.instance(FORMULA));
        for instance in &mut instances {
            initialise(instance, EXPERIMENT);
            instance.step(0.0, 0.1).unwrap();
            instance.reset();
        }
    });
    assert_eq!(more, 0);
    assert!(Arc::ptr_eq(instances[0].description(), instances[1].description()));
}

#[test]
fn a_parameter_of_one_instance_is_no_other_ones() {
    let resources = Resources::new("own-parameter");
    let (mut one, mut other) = (resources.instance(FORMULA), resources.instance(FORMULA));
    set(&mut one, "platform_mass", 5000.0);
    set(&mut one, "disturbance_force_x", 100.0);
    set(&mut other, "disturbance_force_x", 100.0);
    assert_eq!(built(|| initialise(&mut one, EXPERIMENT)), 1);
    initialise(&mut other, EXPERIMENT);
    assert!(get(&mut other, "ax") > 1.5 * get(&mut one, "ax"), "the lighter one");
    one.reset();
    set(&mut one, "disturbance_force_x", 100.0);
    initialise(&mut one, EXPERIMENT);
    assert_eq!(snapshot(&mut one), snapshot(&mut other));
}

#[test]
fn another_model_in_the_same_folder_is_read_anew() {
    let resources = Resources::new("read-anew");
    let first = resources.instance("platform_mass = 1.0");
    let second = resources.instance("platform_mass = 2.0");
    assert_eq!(
        (first.settings.model.parameters.platform_mass, second.settings.model.parameters.platform_mass),
        (1.0, 2.0)
    );
}
