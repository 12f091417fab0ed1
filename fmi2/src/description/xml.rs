//! `modelDescription.xml`, written from the table, and the GUID that goes with it.

use std::fmt::Write as _;

use super::{
    BaseUnit, DependencyKind, DisplayUnit, Enumeration, Initial, Kind, LAYER_LOG_CATEGORIES, ModelDescription,
    RealKind, Unit, Variable,
};

impl ModelDescription {
    /// The text of `modelDescription.xml`: FMI 2.0, co-simulation, UTF-8, the same for the same table.
    ///
    /// Check the table with [`ModelDescription::validate`] first; the writer takes it as it is.
    #[must_use]
    pub fn to_xml(&self) -> String {
        self.write(&self.guid())
    }

    /// The GUID: a hash of everything in the table that a host could rely on (names, value references,
    /// types, roles, units, bounds, starts, structure, capabilities), not of texts for people.
    #[must_use]
    pub fn guid(&self) -> String {
        let digest = fnv1a_128(self.without_texts().write("").as_bytes());
        let hex = format!("{digest:032x}");
        format!("{{{}-{}-{}-{}-{}}}", &hex[..8], &hex[8..12], &hex[12..16], &hex[16..20], &hex[20..])
    }

    fn without_texts(&self) -> Self {
        let mut bare = Self {
            description: None,
            author: None,
            version: None,
            copyright: None,
            license: None,
            generation_tool: None,
            ..self.clone()
        };
        for variable in &mut bare.variables {
            variable.description = None;
        }
        for enumeration in &mut bare.enumerations {
            enumeration.description = None;
            for item in &mut enumeration.items {
                item.description = None;
            }
        }
        for category in &mut bare.log_categories {
            category.description.clear();
        }
        bare
    }

    fn write(&self, guid: &str) -> String {
        let mut xml = Writer::default();
        xml.text.push_str("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
        let root = Tag::new("fmiModelDescription")
            .attr("fmiVersion", "2.0")
            .attr("modelName", &self.model_name)
            .attr("guid", guid)
            .opt("description", self.description.as_ref())
            .opt("author", self.author.as_ref())
            .opt("version", self.version.as_ref())
            .opt("copyright", self.copyright.as_ref())
            .opt("license", self.license.as_ref())
            .opt("generationTool", self.generation_tool.as_ref())
            .attr("variableNamingConvention", "structured");
        xml.element(root, |xml| {
            xml.leaf(self.co_simulation());
            xml.list("UnitDefinitions", &self.units, write_unit);
            xml.list("TypeDefinitions", &self.enumerations, |xml, enumeration| {
                write_enumeration(xml, enumeration);
            });
            self.write_log_categories(xml);
            if let Some(experiment) = self.default_experiment {
                let tag = Tag::new("DefaultExperiment")
                    .opt("startTime", experiment.start_time.map(number))
                    .opt("stopTime", experiment.stop_time.map(number))
                    .opt("tolerance", experiment.tolerance.map(number))
                    .opt("stepSize", experiment.step_size.map(number));
                xml.leaf(tag);
            }
            xml.list("ModelVariables", &self.variables, write_variable);
            self.write_structure(xml);
        });
        xml.text
    }

    fn co_simulation(&self) -> Tag {
        let able = self.capabilities;
        Tag::new("CoSimulation")
            .attr("modelIdentifier", &self.model_identifier)
            .attr("needsExecutionTool", "false")
            .attr("canHandleVariableCommunicationStepSize", "true")
            .attr("canInterpolateInputs", able.can_interpolate_inputs)
            .attr("maxOutputDerivativeOrder", able.max_output_derivative_order)
            .attr("canRunAsynchronuously", "false")
            .attr("canBeInstantiatedOnlyOncePerProcess", "false")
            .attr("canNotUseMemoryManagementFunctions", "true")
            .attr("canGetAndSetFMUstate", "true")
            .attr("canSerializeFMUstate", "true")
            .attr("providesDirectionalDerivative", able.provides_directional_derivative)
    }

    fn write_log_categories(&self, xml: &mut Writer) {
        let own = self.log_categories.iter().map(|c| (c.name.as_str(), c.description.as_str()));
        let categories: Vec<_> = LAYER_LOG_CATEGORIES.into_iter().chain(own).collect();
        xml.list("LogCategories", &categories, |xml, (name, description)| {
            xml.leaf(Tag::new("Category").attr("name", name).attr("description", description));
        });
    }

    fn write_structure(&self, xml: &mut Writer) {
        let stepping = |v: &Variable| v.dependencies.clone();
        let initially = |v: &Variable| v.initial_dependencies.clone();
        xml.element(Tag::new("ModelStructure"), |xml| {
            let unknowns = |list: Vec<usize>, of: &dyn Fn(&Variable) -> _| -> Vec<Tag> {
                list.into_iter().map(|index| unknown(index, of(&self.variables[index]))).collect()
            };
            for (name, tags) in [
                ("Outputs", unknowns(self.outputs().collect(), &stepping)),
                ("Derivatives", unknowns(self.derivatives().collect(), &stepping)),
                ("InitialUnknowns", unknowns(self.initial_unknowns().collect(), &initially)),
            ] {
                xml.list(name, &tags, |xml, tag| xml.leaf(tag.clone()));
            }
        });
    }
}

/// One entry of a list under `ModelStructure`; the XML counts variables from 1.
fn unknown(index: usize, dependencies: Option<Vec<super::Dependency>>) -> Tag {
    let tag = Tag::new("Unknown").attr("index", index + 1);
    let Some(mut list) = dependencies else {
        return tag;
    };
    list.sort_by_key(|d| d.index);
    let join = |texts: Vec<String>| texts.join(" ");
    let indices = list.iter().map(|d| (d.index + 1).to_string()).collect();
    let kinds = list.iter().map(|d| kind_name(d.kind).to_owned()).collect();
    let tag = tag.attr("dependencies", join(indices));
    // An empty list of kinds says nothing, and some readers stumble over it.
    if list.is_empty() { tag } else { tag.attr("dependenciesKind", join(kinds)) }
}

fn write_unit(xml: &mut Writer, unit: &Unit) {
    xml.element(Tag::new("Unit").attr("name", &unit.name), |xml| {
        if let Some(base) = unit.base {
            xml.leaf(base_unit(base));
        }
        for DisplayUnit { name, factor, offset } in &unit.display_units {
            let tag = Tag::new("DisplayUnit")
                .attr("name", name)
                .attr("factor", number(*factor))
                .opt("offset", (*offset != 0.0).then(|| number(*offset)));
            xml.leaf(tag);
        }
    });
}

fn base_unit(base: BaseUnit) -> Tag {
    let mut tag = Tag::new("BaseUnit");
    for (name, exponent) in [
        ("kg", base.kg),
        ("m", base.m),
        ("s", base.s),
        ("A", base.ampere),
        ("K", base.kelvin),
        ("mol", base.mol),
        ("cd", base.cd),
        ("rad", base.rad),
    ] {
        tag = tag.opt(name, (exponent != 0).then_some(exponent));
    }
    let (factor, offset) = (base.factor, base.offset);
    tag.opt("factor", (factor != 1.0).then(|| number(factor))).opt("offset", (offset != 0.0).then(|| number(offset)))
}

fn write_enumeration(xml: &mut Writer, enumeration: &Enumeration) {
    let tag =
        Tag::new("SimpleType").attr("name", &enumeration.name).opt("description", enumeration.description.as_ref());
    xml.element(tag, |xml| {
        xml.list("Enumeration", &enumeration.items, |xml, item| {
            let tag = Tag::new("Item")
                .attr("name", &item.name)
                .attr("value", item.value)
                .opt("description", item.description.as_ref());
            xml.leaf(tag);
        });
    });
}

fn write_variable(xml: &mut Writer, variable: &Variable) {
    let tag = Tag::new("ScalarVariable")
        .attr("name", &variable.name)
        .attr("valueReference", variable.value_reference)
        .opt("description", variable.description.as_ref())
        .attr("causality", variable.causality.name())
        .attr("variability", variable.variability.name())
        .opt("initial", variable.effective_initial().map(Initial::name));
    xml.element(tag, |xml| xml.leaf(type_tag(&variable.kind)));
}

fn type_tag(kind: &Kind) -> Tag {
    match kind {
        Kind::Real(real) => real_tag(real),
        Kind::Integer(integer) => Tag::new("Integer")
            .opt("quantity", integer.quantity.as_ref())
            .opt("min", integer.min)
            .opt("max", integer.max)
            .opt("start", integer.start),
        Kind::Boolean { start } => Tag::new("Boolean").opt("start", *start),
        Kind::String { start } => Tag::new("String").opt("start", start.as_ref()),
        Kind::Enumeration { type_name, start } => {
            Tag::new("Enumeration").attr("declaredType", type_name).opt("start", *start)
        }
    }
}

fn real_tag(real: &RealKind) -> Tag {
    Tag::new("Real")
        .opt("quantity", real.quantity.as_ref())
        .opt("unit", real.unit.as_ref())
        .opt("displayUnit", real.display_unit.as_ref())
        .opt("min", real.min.map(number))
        .opt("max", real.max.map(number))
        .opt("nominal", real.nominal.map(number))
        .opt("start", real.start.map(number))
        .opt("derivative", real.derivative_of.map(|state| state + 1))
}

fn kind_name(kind: DependencyKind) -> &'static str {
    match kind {
        DependencyKind::Dependent => "dependent",
        DependencyKind::Constant => "constant",
        DependencyKind::Fixed => "fixed",
        DependencyKind::Tunable => "tunable",
        DependencyKind::Discrete => "discrete",
    }
}

/// The shortest decimal that reads back as the same number, with an exponent where that is shorter.
fn number(value: f64) -> String {
    format!("{value:?}")
}

/// 128-bit FNV-1a: a fingerprint against mix-ups, not against an adversary.
fn fnv1a_128(bytes: &[u8]) -> u128 {
    const OFFSET: u128 = 0x6c62_272e_07bb_0142_62b8_2175_6295_c58d;
    const PRIME: u128 = 0x0000_0000_0100_0000_0000_0000_0000_013b;
    bytes.iter().fold(OFFSET, |hash, &byte| (hash ^ u128::from(byte)).wrapping_mul(PRIME))
}

/// An element's name and attributes.
#[derive(Clone)]
struct Tag {
    name: &'static str,
    attributes: String,
}

impl Tag {
    fn new(name: &'static str) -> Self {
        Self { name, attributes: String::new() }
    }

    fn attr(mut self, name: &str, value: impl ToString) -> Self {
        let value = escape(&value.to_string());
        let _ = write!(self.attributes, " {name}=\"{value}\"");
        self
    }

    fn opt(self, name: &str, value: Option<impl ToString>) -> Self {
        match value {
            Some(value) => self.attr(name, value),
            None => self,
        }
    }
}

/// Text for an attribute; line breaks and tabs as references, since a reader turns raw ones into blanks.
fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\t' | '\n' | '\r' => {
                let _ = write!(out, "&#{};", u32::from(c));
            }
            c => out.push(c),
        }
    }
    out
}

#[derive(Default)]
struct Writer {
    text: String,
    depth: usize,
}

impl Writer {
    fn line(&mut self, line: &str) {
        let _ = writeln!(self.text, "{:indent$}{line}", "", indent = 2 * self.depth);
    }

    fn leaf(&mut self, tag: Tag) {
        self.line(&format!("<{}{}/>", tag.name, tag.attributes));
    }

    fn element(&mut self, tag: Tag, inside: impl FnOnce(&mut Self)) {
        self.line(&format!("<{}{}>", tag.name, tag.attributes));
        self.depth += 1;
        inside(self);
        self.depth -= 1;
        self.line(&format!("</{}>", tag.name));
    }

    /// An element around the items; nothing where there are none, since the schema allows no empty list.
    fn list<T>(&mut self, name: &'static str, items: &[T], mut each: impl FnMut(&mut Self, &T)) {
        if items.is_empty() {
            return;
        }
        self.element(Tag::new(name), |xml| {
            for item in items {
                each(xml, item);
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> ModelDescription {
        let mut table = ModelDescription::new("A model", "Model");
        table.units = vec![Unit::mechanical("m", 0, 1, 0, 0)];
        table.add(Variable::real("u", 0).input().unit("m").start(0.1));
        table
    }

    #[test]
    fn numbers_read_back_as_the_same() {
        for value in [0.1, 1.0, -0.0, 1e300, 5e-324, 1.0 / 3.0, 1234567.125, f64::MAX] {
            let read: f64 = number(value).parse().unwrap();
            assert_eq!(read.to_bits(), value.to_bits());
        }
        assert_eq!(number(1e300), "1e300");
    }

    #[test]
    fn text_is_escaped() {
        let mut model = table();
        model.model_name = "a<b> & \"c\"\n\u{fc}".into();
        let xml = model.to_xml();
        assert!(xml.contains("modelName=\"a&lt;b&gt; &amp; &quot;c&quot;&#10;\u{fc}\""), "{xml}");
    }

    #[test]
    fn the_guid_follows_the_interface_and_nothing_else() {
        let guid = table().guid();
        assert_eq!(guid.len(), 38);
        assert!(table().to_xml().contains(&guid));

        let mut texts = table();
        texts.author = Some("someone".into());
        texts.variables[0].description = Some("an input".into());
        assert_eq!(texts.guid(), guid);

        let changes: [fn(&mut ModelDescription); 6] = [
            |t| t.variables[0].value_reference = 1,
            |t| t.variables[0].name = "v".into(),
            |t| t.variables[0] = Variable::real("u", 0).input().unit("m").start(0.2),
            |t| t.variables[0] = Variable::real("u", 0).input().start(0.1),
            |t| t.capabilities.can_interpolate_inputs = false,
            |t| t.units[0].name = "n".into(),
        ];
        for change in changes {
            let mut changed = table();
            change(&mut changed);
            assert_ne!(changed.guid(), guid);
        }
    }

    #[test]
    fn fnv_agrees_with_its_published_vectors() {
        assert_eq!(fnv1a_128(b""), 0x6c62_272e_07bb_0142_62b8_2175_6295_c58d);
        assert_eq!(fnv1a_128(b"a"), 0xd228_cb69_6f1a_8caf_7891_2b70_4e4a_8964);
    }
}
