//! Which file of a crate imports from which.

use std::collections::{BTreeMap, BTreeSet};

use syn::{
    Attribute, Expr, File, Item, ItemMod, ItemUse, Macro, Token, UseTree, Visibility,
    punctuated::Punctuated,
    visit::{self, Visit},
};

/// A module, from the crate's root: `["report", "page"]`.
pub(crate) type Module = Vec<String>;

/// Every module that is a file, with the modules it imports from. A parent that only hands on what its children offer
/// (`pub use`) imports nothing, and neither do tests.
pub(crate) type Imports = BTreeMap<Module, BTreeSet<Module>>;

/// The module of a file, by its path below `src`.
pub(crate) fn module(path: &str) -> Module {
    let path = path.trim_end_matches(".rs").trim_end_matches("/mod");
    match path {
        "lib" | "main" => Vec::new(),
        path => path.split('/').map(str::to_owned).collect(),
    }
}

/// The imports between the files of a crate, from their modules and texts.
pub(crate) fn imports(files: &BTreeMap<Module, String>) -> Imports {
    let scans: BTreeMap<&Module, Scan> = files
        .iter()
        .map(|(module, text)| {
            let file: File = syn::parse_file(text).unwrap_or_else(|e| panic!("{module:?}: {e}"));
            let mut scan = Scan { inner: module.clone(), ..Scan::default() };
            scan.visit_file(&file);
            (module, scan)
        })
        .collect();
    let tests: BTreeSet<Module> = scans.values().flat_map(|scan| scan.tests.clone()).collect();
    let names: BTreeMap<Module, Module> = scans
        .values()
        .flat_map(|scan| &scan.uses)
        .filter_map(|used| {
            let target = absolute(&used.path, &used.inside, files)?;
            Some((joined(&used.inside, used.name.clone()), target))
        })
        .collect();
    let owner = |path: &[String], inside: &[String]| {
        let mut path = absolute(path, inside, files)?;
        // A name that a module has from elsewhere is that of the file it comes from.
        for _ in 0..files.len() {
            let longer =
                |n: &usize| names.contains_key(&path[..*n]) && !files.contains_key(&path[..*n]);
            let Some(n) = (1..=path.len()).find(longer) else { break };
            path = [names[&path[..n]].as_slice(), &path[n..]].concat();
        }
        (0..=path.len()).rev().map(|n| path[..n].to_vec()).find(|m| files.contains_key(m))
    };
    let of = |module: &Module, scan: &Scan| -> BTreeSet<Module> {
        let uses = scan.uses.iter().filter(|used| {
            let target = absolute(&used.path, &used.inside, files);
            !(used.is_public && target.is_some_and(|t| t.starts_with(module)))
        });
        let paths = uses.map(|used| (&used.path, &used.inside));
        let paths = paths.chain(scan.paths.iter().map(|(path, inside)| (path, inside)));
        let owners = paths.filter_map(|(path, inside)| owner(path, inside));
        owners.filter(|owner| owner != module).collect()
    };
    let real = scans.iter().filter(|(module, _)| !tests.contains(**module));
    real.map(|(module, scan)| ((*module).clone(), of(module, scan))).collect()
}

/// Modules on a circle of imports, or between two of them; none where imports go one way.
pub(crate) fn circles(imports: &Imports) -> Vec<String> {
    let mut left = imports.clone();
    loop {
        let used: BTreeSet<Module> = left.values().flatten().cloned().collect();
        let count = left.len();
        left.retain(|module, of| !of.is_empty() && used.contains(module));
        if left.len() == count {
            break;
        }
        let modules: BTreeSet<Module> = left.keys().cloned().collect();
        left.values_mut().for_each(|of| of.retain(|m| modules.contains(m)));
    }
    let line = |(module, of): (&Module, &BTreeSet<Module>)| {
        let of: Vec<String> = of.iter().map(|m| shown(m)).collect();
        format!("{} imports from {}", shown(module), of.join(", "))
    };
    left.iter().map(line).collect()
}

/// A path and one more name.
fn joined(path: &[String], name: String) -> Vec<String> {
    path.iter().cloned().chain([name]).collect()
}

/// As it is written.
pub(crate) fn shown(module: &[String]) -> String {
    if module.is_empty() { "the root".to_owned() } else { module.join("::") }
}

/// A path from the crate's root; none where it leads out of the crate.
fn absolute(
    path: &[String],
    inside: &[String],
    files: &BTreeMap<Module, String>,
) -> Option<Module> {
    let mut base = inside.to_vec();
    let mut rest = path;
    match rest.first()?.as_str() {
        "crate" => (base, rest) = (Vec::new(), &rest[1..]),
        "self" => rest = &rest[1..],
        "super" => {}
        child => {
            base.push(child.to_owned());
            return files.contains_key(&base).then(|| [inside, path].concat());
        }
    }
    while rest.first().is_some_and(|s| s == "super") {
        base.pop()?;
        rest = &rest[1..];
    }
    base.extend_from_slice(rest);
    Some(base)
}

/// One name of a `use`.
struct Use {
    inside: Module,
    path: Vec<String>,
    name: String,
    is_public: bool,
}

/// What a file names.
#[derive(Default)]
struct Scan {
    /// Where the scan is: the file's module, or one within it.
    inner: Module,
    uses: Vec<Use>,
    /// Other paths, each with the module that it stands in.
    paths: Vec<(Vec<String>, Module)>,
    /// Modules that are compiled for tests only.
    tests: Vec<Module>,
}

impl Scan {
    fn tree(&mut self, tree: &UseTree, before: &[String], is_public: bool) {
        let with = |name: &syn::Ident| joined(before, name.to_string());
        let (path, name) = match tree {
            UseTree::Path(path) => return self.tree(&path.tree, &with(&path.ident), is_public),
            UseTree::Group(group) => {
                return group.items.iter().for_each(|tree| self.tree(tree, before, is_public));
            }
            UseTree::Name(name) if name.ident == "self" => {
                (before.to_vec(), before.last().cloned().unwrap_or_default())
            }
            UseTree::Name(name) => (with(&name.ident), name.ident.to_string()),
            UseTree::Rename(rename) => (with(&rename.ident), rename.rename.to_string()),
            UseTree::Glob(_) => (before.to_vec(), "*".to_owned()),
        };
        self.uses.push(Use { inside: self.inner.clone(), path, name, is_public });
    }
}

impl<'a> Visit<'a> for Scan {
    fn visit_item(&mut self, item: &'a Item) {
        let attributes: &[Attribute] = match item {
            Item::Mod(item) => &item.attrs,
            Item::Use(item) => &item.attrs,
            Item::Fn(item) => &item.attrs,
            _ => &[],
        };
        if attributes.iter().any(is_for_tests) {
            if let Item::Mod(item) = item {
                self.tests.push(joined(&self.inner, item.ident.to_string()));
            }
            return;
        }
        visit::visit_item(self, item);
    }

    fn visit_item_mod(&mut self, item: &'a ItemMod) {
        self.inner.push(item.ident.to_string());
        visit::visit_item_mod(self, item);
        self.inner.pop();
    }

    fn visit_item_use(&mut self, item: &'a ItemUse) {
        self.tree(&item.tree, &[], !matches!(item.vis, Visibility::Inherited));
    }

    fn visit_path(&mut self, path: &'a syn::Path) {
        let names: Vec<String> = path.segments.iter().map(|s| s.ident.to_string()).collect();
        if names.len() > 1 {
            self.paths.push((names, self.inner.clone()));
        }
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, call: &'a Macro) {
        let arguments = Punctuated::<Expr, Token![,]>::parse_terminated;
        if let Ok(arguments) = call.parse_body_with(arguments) {
            // They live as long as this call; what is kept of them is copied.
            arguments.iter().for_each(|argument| Scan::visit_expr(self, argument));
        }
    }
}

/// `#[cfg(test)]`
fn is_for_tests(attribute: &Attribute) -> bool {
    let test = |a: &Attribute| a.parse_args::<syn::Ident>().is_ok_and(|name| name == "test");
    attribute.path().is_ident("cfg") && test(attribute)
}
