/* Where no page has all words of a search: the pages that have some, the rare words first. */
if (typeof Search !== "undefined") {
    const pagesWithAll = Search.performTermsSearch;
    Search.performTermsSearch = (terms, excluded) => {
        const found = pagesWithAll(terms, excluded);
        if (found.length > 0) return found;
        const pages = new Map();
        for (const term of terms) {
            const some = pagesWithAll(new Set([term]), excluded);
            for (const [name, title, anchor, about, score, ...rest] of some) {
                const before = pages.get(name)?.[4] ?? 0;
                pages.set(name, [name, title, anchor, about, before + score / some.length, ...rest]);
            }
        }
        return [...pages.values()];
    };
}
