/* SPDX-License-Identifier: GPL-3.0-or-later */
/*---------------------------------------------------------------------------*\
    Dictionary to text with line numbers: see caseText.H.
\*---------------------------------------------------------------------------*/

#include "caseText.H"
#include "ITstream.H"
#include "StringStream.H"

namespace Foam
{

// Digits that give every decimal of a user (up to fifteen) back unchanged
static const int textPrecision = 15;


// The line of a token is meaningful only within its entry: a macro brings its
// tokens along with lines of their own.
static void writeTokens(Ostream& os, const entry& e)
{
    label line = e.startLineNumber();
    const label last = e.endLineNumber();

    for (const token& t : static_cast<const tokenList&>(e.stream()))
    {
        for (; line < t.lineNumber() && t.lineNumber() <= last; ++line)
        {
            os << nl;
        }
        os << token::SPACE << t;
    }
    os << token::END_STATEMENT << nl;
}


static void writeEntries(Ostream& os, const dictionary& dict)
{
    for (const entry& e : dict)
    {
        if (e.startLineNumber() > 0)
        {
            os << "#line " << e.startLineNumber() << nl;
        }
        os << e.keyword();

        if (e.isDict())
        {
            os << nl << token::BEGIN_BLOCK << nl;
            writeEntries(os, e.dict());
            os << token::END_BLOCK << nl;
        }
        else
        {
            writeTokens(os, e);
        }
    }
}


string caseText(const dictionary& dict)
{
    OStringStream os;
    os.precision(textPrecision);
    writeEntries(os, dict);
    return os.str();
}

} // End namespace Foam
