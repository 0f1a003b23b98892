//! The files that bring the user's hooks into a runner, under names of their own.

use proc_macro2::{Ident, TokenStream};
use quote::{format_ident, quote};

use super::rust;
use crate::names;

/// A hook as a registry has it.
pub(super) struct Registered<'a> {
    /// The metric or operation it is of.
    pub(super) name: &'a str,
    /// That in words, with where it is declared: a note for who meets an error of rustc's here.
    pub(super) declared: String,
}

/// Such a file: it begins with `docs`, takes each hook in, and goes on with what `table` makes of the types under which
/// the hooks are known there, in order.
///
/// `hooks` is where the hook files are, as seen from the file's folder.
pub(super) fn registry(
    header: &str,
    docs: &TokenStream,
    hooks: &str,
    registered: &[Registered<'_>],
    table: impl FnOnce(&[Ident]) -> TokenStream,
) -> String {
    let module = |hook: &Registered<'_>| names::ident(&names::snake(hook.name));
    let modules = registered.iter().map(|hook| {
        let file = format!("{hooks}/{}.rs", names::snake(hook.name));
        let module = module(hook);
        quote! { #[path = #file] mod #module; }
    });
    // The user's struct as the registry calls it: short, so that rustc shows the note at the end of its line too.
    let types: Vec<Ident> = (0..registered.len()).map(|at| format_ident!("Hook{at}")).collect();
    let imports = registered.iter().zip(&types).map(|(hook, here)| {
        let (module, user) = (module(hook), names::ident(&names::hook_type(hook.name)));
        quote! { use self::#module::#user as #here; }
    });
    let notes: Vec<(String, String)> = registered
        .iter()
        .map(|hook| (format!("use self::{}::", names::written(&names::snake(hook.name))), hook.declared.clone()))
        .collect();
    let table = table(&types);
    let source = rust::file(header, quote! { #docs #(#modules)* #(#imports)* #table });
    rust::note_lines(&source, &notes)
}
