//! What a crate shows: every `pub` item of its files, by their text. The lint `unreachable_pub` sees to it that what is
//! `pub` can be reached from outside.

use std::{collections::BTreeMap, path::Path};

use quote::ToTokens;
use syn::{
    Attribute, Fields, FnArg, ImplItem, Item, ItemEnum, ItemImpl, ItemStruct, ItemTrait, Pat,
    Signature, TraitItem, Visibility,
};

/// A line an item, sorted: where it stands, and what it says without its body.
pub(crate) fn listing(files: &BTreeMap<String, String>) -> Vec<String> {
    let mut lines = Vec::new();
    for (path, text) in files {
        // what is made for tests of others is no promise
        if Path::new(path).file_name().is_some_and(|name| name == "strategies.rs") {
            continue;
        }
        let file = syn::parse_file(text).unwrap_or_else(|e| panic!("{path}: {e}"));
        items(path.trim_end_matches(".rs"), &file.items, &mut lines);
    }
    lines.sort();
    lines
}

fn items(place: &str, all: &[Item], lines: &mut Vec<String>) {
    for item in all {
        let said = match item {
            Item::Fn(f) if is_pub(&f.vis) => words(&signature(&f.sig)),
            Item::Const(c) if is_pub(&c.vis) => {
                format!("const {}: {}", c.ident, words(&c.ty))
            }
            Item::Static(s) if is_pub(&s.vis) => format!("static {}: {}", s.ident, words(&s.ty)),
            Item::Type(t) if is_pub(&t.vis) => {
                format!("type {}{} = {}", t.ident, words(&t.generics), words(&t.ty))
            }
            Item::Struct(s) if is_pub(&s.vis) => structure(s),
            Item::Enum(e) if is_pub(&e.vis) => enumeration(e),
            Item::Trait(t) if is_pub(&t.vis) => interface(t),
            Item::Use(u) if is_pub(&u.vis) => format!("use {}", words(&u.tree)),
            Item::Mod(m) if !is_for_tests(&m.attrs) => {
                if let Some((_, inner)) = &m.content {
                    items(&format!("{place}::{}", m.ident), inner, lines);
                }
                if !is_pub(&m.vis) {
                    continue;
                }
                format!("mod {}", m.ident)
            }
            Item::Impl(block) if !is_for_tests(&block.attrs) => {
                implementation(place, block, lines);
                continue;
            }
            _ => continue,
        };
        lines.push(format!("{place}: {said}"));
    }
}

fn structure(s: &ItemStruct) -> String {
    let fields = match &s.fields {
        Fields::Named(named) => {
            let shown = named.named.iter().filter(|f| is_pub(&f.vis));
            let shown = shown.map(|f| {
                let name = f.ident.as_ref().map_or(String::new(), ToString::to_string);
                format!("{name}: {}", words(&f.ty))
            });
            let hidden = named.named.iter().any(|f| !is_pub(&f.vis)).then(|| "..".to_owned());
            format!(" {{ {} }}", shown.chain(hidden).collect::<Vec<_>>().join(", "))
        }
        Fields::Unnamed(unnamed) => {
            let shown = unnamed.unnamed.iter();
            let shown = shown.map(|f| if is_pub(&f.vis) { words(&f.ty) } else { "..".to_owned() });
            format!("({})", shown.collect::<Vec<_>>().join(", "))
        }
        Fields::Unit => String::new(),
    };
    let (generics, bounds) = (words(&s.generics), words(&s.generics.where_clause));
    format!("{}struct {}{generics}{bounds}{fields}", marks(&s.attrs), s.ident)
}

fn enumeration(e: &ItemEnum) -> String {
    let variant = |v: &syn::Variant| {
        let fields = match &v.fields {
            Fields::Unit => String::new(),
            Fields::Unnamed(fields) => {
                let types = fields.unnamed.iter().map(|f| words(&f.ty)).collect::<Vec<_>>();
                format!("({})", types.join(", "))
            }
            Fields::Named(fields) => {
                let one = |f: &syn::Field| format!("{}: {}", words(&f.ident), words(&f.ty));
                let types = fields.named.iter().map(one).collect::<Vec<_>>();
                format!(" {{ {} }}", types.join(", "))
            }
        };
        format!("{}{fields}", v.ident)
    };
    let variants: Vec<_> = e.variants.iter().map(variant).collect();
    let generics = words(&e.generics);
    format!("{}enum {}{generics} {{ {} }}", marks(&e.attrs), e.ident, variants.join(", "))
}

fn interface(t: &ItemTrait) -> String {
    let part = |item: &TraitItem| match item {
        TraitItem::Fn(f) if f.default.is_some() => {
            format!("{} {{ .. }}", words(&signature(&f.sig)))
        }
        TraitItem::Fn(f) => words(&signature(&f.sig)),
        TraitItem::Type(own) => format!("type {}: {}", own.ident, words(&own.bounds)),
        TraitItem::Const(own) => format!("const {}: {}", own.ident, words(&own.ty)),
        other => words(other),
    };
    let parts: Vec<_> = t.items.iter().map(part).collect();
    let (generics, above) = (words(&t.generics), words(&t.supertraits));
    format!("trait {}{generics}: {above} {{ {} }}", t.ident, parts.join("; "))
}

fn implementation(place: &str, block: &ItemImpl, lines: &mut Vec<String>) {
    let head = format!("impl{} {}", words(&block.generics), words(&block.self_ty));
    let bounds = words(&block.generics.where_clause);
    if let Some((_, of, _)) = &block.trait_ {
        lines.push(format!("{place}: {head}: {}{bounds}", words(of)));
        return;
    }
    for item in &block.items {
        let said = match item {
            ImplItem::Fn(f) if is_pub(&f.vis) => words(&signature(&f.sig)),
            ImplItem::Const(c) if is_pub(&c.vis) => format!("const {}: {}", c.ident, words(&c.ty)),
            _ => continue,
        };
        lines.push(format!("{place}: {head}{bounds} {{ {said} }}"));
    }
}

/// What is derived, and whether more may come.
fn marks(attributes: &[Attribute]) -> String {
    let told = ["derive", "non_exhaustive", "must_use"];
    let is_told = |a: &&Attribute| told.iter().any(|name| a.path().is_ident(name));
    attributes.iter().filter(is_told).map(|a| format!("{} ", words(&a.meta))).collect()
}

fn is_pub(visibility: &Visibility) -> bool {
    matches!(visibility, Visibility::Public(_))
}

fn is_for_tests(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|a| a.path().is_ident("cfg") && words(&a.meta).contains("test"))
}

/// As it is written, in one line.
/// What a caller sees of a signature: whether a function changes its own copy of an argument is its own matter.
fn signature(sig: &Signature) -> Signature {
    let mut seen = sig.clone();
    for argument in &mut seen.inputs {
        if let FnArg::Typed(typed) = argument
            && let Pat::Ident(name) = typed.pat.as_mut()
        {
            name.mutability = None;
        }
    }
    seen
}

fn words(tokens: &impl ToTokens) -> String {
    let text = tokens.to_token_stream().to_string();
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
