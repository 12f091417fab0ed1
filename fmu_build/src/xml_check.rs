//! Reads the XML text back, as an importer would, and checks that it holds together.

use std::collections::{HashMap, HashSet};

use roxmltree::{Document, Node};

/// What is wrong with the XML text of a co-simulation FMU; empty if nothing.
///
/// This looks at the text alone, not at the table it was written from: well-formed, the right root and
/// versions, unique names and value references, declared units and types, indices that lead somewhere.
pub(crate) fn problems(xml: &str, model_identifier: &str) -> Vec<String> {
    let document = match Document::parse(xml) {
        Ok(document) => document,
        Err(error) => return vec![format!("it is not well-formed: {error}")],
    };
    let mut check = Check { root: document.root_element(), problems: Vec::new() };
    check.header(model_identifier);
    let variables = check.children("ModelVariables");
    check.variables(&variables);
    check.structure(&variables);
    check.problems
}

struct Check<'a, 'input> {
    root: Node<'a, 'input>,
    problems: Vec<String>,
}

impl<'a, 'input> Check<'a, 'input> {
    fn expect(&mut self, kept: bool, problem: impl FnOnce() -> String) {
        if !kept {
            self.problems.push(problem());
        }
    }

    /// The element children of the root's child with this name.
    fn children(&self, name: &str) -> Vec<Node<'a, 'input>> {
        child(self.root, name).map_or_else(Vec::new, |node| elements(node).collect())
    }

    fn header(&mut self, model_identifier: &str) {
        let root = self.root;
        self.expect(root.has_tag_name("fmiModelDescription"), || {
            format!("the root is <{}>, expected <fmiModelDescription>", root.tag_name().name())
        });
        let version = root.attribute("fmiVersion");
        self.expect(version == Some("2.0"), || format!("fmiVersion is {version:?}, expected \"2.0\""));
        for name in ["modelName", "guid"] {
            let present = root.attribute(name).is_some_and(|text| !text.is_empty());
            self.expect(present, || format!("{name} is missing or empty"));
        }
        let interface = child(root, "CoSimulation");
        let identifier = interface.and_then(|node| node.attribute("modelIdentifier"));
        self.expect(identifier == Some(model_identifier), || {
            format!("CoSimulation names the binary {identifier:?}, expected {model_identifier:?}")
        });
        for name in ["ModelVariables", "ModelStructure"] {
            self.expect(child(root, name).is_some(), || format!("<{name}> is missing"));
        }
    }

    fn variables(&mut self, variables: &[Node]) {
        self.expect(!variables.is_empty(), || "there are no variables".into());
        let names_of = |list: &[Node]| -> HashSet<String> {
            list.iter().filter_map(|node| node.attribute("name").map(str::to_owned)).collect()
        };
        let units = names_of(&self.children("UnitDefinitions"));
        let types = names_of(&self.children("TypeDefinitions"));
        let mut names = HashSet::new();
        let mut references = HashMap::new();
        for variable in variables {
            let name = variable.attribute("name").unwrap_or_default();
            self.expect(!name.is_empty(), || "a variable has no name".into());
            self.expect(names.insert(name), || format!("`{name}` is listed twice"));
            let Some(kind) = elements(*variable).next() else {
                self.problems.push(format!("`{name}` has no type"));
                continue;
            };
            // The C functions read enumerations as integers, so both share one set of value references.
            let base = match kind.tag_name().name() {
                "Enumeration" => "Integer",
                other => other,
            };
            match number(*variable, "valueReference") {
                None => self.problems.push(format!("`{name}` has no value reference")),
                Some(reference) => {
                    if let Some(first) = references.insert((base, reference), name) {
                        self.problems
                            .push(format!("`{first}` and `{name}` share the value reference {reference} of {base}"));
                    }
                }
            }
            for (attribute, defined) in [("unit", &units), ("declaredType", &types)] {
                if let Some(used) = kind.attribute(attribute) {
                    self.expect(defined.contains(used), || format!("`{name}`: {attribute} `{used}` is not defined"));
                }
            }
            if kind.has_attribute("derivative") {
                let state = number(kind, "derivative");
                self.expect(leads_to(variables, state), || {
                    format!("`{name}` is the derivative of no variable: {state:?}")
                });
            }
        }
    }

    fn structure(&mut self, variables: &[Node]) {
        let outputs = numbers_where(variables, |node| node.attribute("causality") == Some("output"));
        let derivatives = numbers_where(variables, |node| elements(*node).any(|kind| kind.has_attribute("derivative")));
        for list in self.children("ModelStructure") {
            let title = list.tag_name().name();
            let unknowns: Vec<_> = elements(list).collect();
            let indices: HashSet<_> = unknowns.iter().filter_map(|node| number(*node, "index")).collect();
            self.expect(indices.len() == unknowns.len(), || {
                format!("{title}: an unknown has no index, or one that is listed twice")
            });
            for unknown in unknowns {
                self.unknown(title, unknown, variables);
            }
        }
        for (title, wanted) in [("Outputs", outputs), ("Derivatives", derivatives)] {
            let listed: HashSet<usize> = child(self.root, "ModelStructure")
                .and_then(|structure| child(structure, title))
                .map_or_else(HashSet::new, |list| elements(list).filter_map(|node| number(node, "index")).collect());
            self.expect(listed == wanted, || {
                format!("{title} lists {} variables, {} are such", listed.len(), wanted.len())
            });
        }
    }

    fn unknown(&mut self, title: &str, unknown: Node, variables: &[Node]) {
        let index = number(unknown, "index");
        self.expect(leads_to(variables, index), || format!("{title}: index {index:?} leads to no variable"));
        let knowns = unknown.attribute("dependencies").map(words);
        let kinds = unknown.attribute("dependenciesKind").map(words);
        for known in knowns.iter().flatten() {
            self.expect(leads_to(variables, known.parse().ok()), || {
                format!("{title}: {index:?} depends on {known}, which leads to no variable")
            });
        }
        if let Some(kinds) = kinds {
            let dependencies = knowns.as_ref().map_or(0, Vec::len);
            self.expect(kinds.len() == dependencies, || {
                format!("{title}: {index:?} has {dependencies} dependencies and {} kinds", kinds.len())
            });
        }
    }
}

fn elements<'a, 'input>(node: Node<'a, 'input>) -> impl Iterator<Item = Node<'a, 'input>> {
    node.children().filter(Node::is_element)
}

fn child<'a, 'input>(node: Node<'a, 'input>, name: &str) -> Option<Node<'a, 'input>> {
    elements(node).find(|child| child.has_tag_name(name))
}

fn number(node: Node, attribute: &str) -> Option<usize> {
    node.attribute(attribute)?.parse().ok()
}

fn words(text: &str) -> Vec<&str> {
    text.split_whitespace().collect()
}

/// The XML counts variables from 1.
fn leads_to(variables: &[Node], number: Option<usize>) -> bool {
    number.is_some_and(|number| (1..=variables.len()).contains(&number))
}

fn numbers_where(variables: &[Node], keep: impl Fn(&Node) -> bool) -> HashSet<usize> {
    (1..).zip(variables).filter_map(|(number, node)| keep(node).then_some(number)).collect()
}

#[cfg(test)]
mod tests {
    use super::problems;

    const SOUND: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="A" guid="{1}">
  <CoSimulation modelIdentifier="A"/>
  <UnitDefinitions><Unit name="m"/></UnitDefinitions>
  <ModelVariables>
    <ScalarVariable name="u" valueReference="0" causality="input"><Real unit="m" start="0"/></ScalarVariable>
    <ScalarVariable name="x" valueReference="1" causality="output"><Real unit="m"/></ScalarVariable>
    <ScalarVariable name="der(x)" valueReference="2"><Real derivative="2"/></ScalarVariable>
    <ScalarVariable name="n" valueReference="0" causality="parameter"><Integer start="1"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs><Unknown index="2" dependencies="1" dependenciesKind="fixed"/></Outputs>
    <Derivatives><Unknown index="3"/></Derivatives>
  </ModelStructure>
</fmiModelDescription>"#;

    #[test]
    fn a_sound_text_passes() {
        assert_eq!(problems(SOUND, "A"), Vec::<String>::new());
    }

    #[test]
    fn each_fault_is_named() {
        for (right, wrong, expected) in [
            ("</ModelStructure>", "</ModelStruct>", "well-formed"),
            ("fmiVersion=\"2.0\"", "fmiVersion=\"3.0\"", "fmiVersion"),
            ("guid=\"{1}\"", "guid=\"\"", "guid"),
            ("modelIdentifier=\"A\"", "modelIdentifier=\"B\"", "names the binary"),
            ("name=\"x\"", "name=\"u\"", "`u` is listed twice"),
            ("valueReference=\"1\"", "valueReference=\"0\"", "share the value reference 0"),
            ("valueReference=\"1\"", "valueReference=\"-1\"", "no value reference"),
            ("<Real unit=\"m\"/>", "<Real unit=\"km\"/>", "unit `km` is not defined"),
            ("<Real unit=\"m\"/>", "", "`x` has no type"),
            ("derivative=\"2\"", "derivative=\"5\"", "derivative of no variable"),
            ("Unknown index=\"2\"", "Unknown index=\"9\"", "leads to no variable"),
            ("Unknown index=\"2\"", "Unknown index=\"1\"", "Outputs lists"),
            ("<Derivatives><Unknown index=\"3\"/></Derivatives>", "", "Derivatives lists 0"),
            ("dependencies=\"1\"", "dependencies=\"7\"", "depends on 7"),
            ("dependenciesKind=\"fixed\"", "dependenciesKind=\"fixed fixed\"", "2 kinds"),
            ("<Integer start=\"1\"/>", "<Enumeration declaredType=\"T\"/>", "`T` is not defined"),
        ] {
            assert_eq!(SOUND.matches(right).count(), 1, "{right}");
            let found = problems(&SOUND.replace(right, wrong), "A").join("; ");
            assert!(found.contains(expected), "{wrong}: {found}");
        }
    }
}
