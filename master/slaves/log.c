/* The logger that FMUs of FMI 1.0 and 2.0 call: puts the values into the message, and hands it on as a text.
 *
 * A message is a format of printf, and what an FMU writes there is not always meant as one: %n, which would write into
 * memory that nobody has given, is text here.
 */
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#define SHOWN __attribute__((visibility("default")))
enum { LONGEST = 16384 };

typedef void (*Receiver)(void *, const char *, int, const char *, const char *);
static Receiver receiver;

SHOWN void hand_messages_to(Receiver function) { receiver = function; }

/* A format without conversions that write. */
static void harmless(const char *from, char *to, size_t room)
{
    const char *end;
    while (*from && room > 3) {
        if (*from != '%') { *to++ = *from++; room--; continue; }
        end = from + 1;
        end += strspn(end, "-+ #0'0123456789.*hlLqjzt");
        if (*end == 'n') { *to++ = '%'; room--; } /* "%%n" */
        do { *to++ = *from++; room--; } while (from <= end && *from && room > 3);
    }
    *to = 0;
}

SHOWN void write_message(void *environment, const char *name, int status, const char *category, const char *message, ...)
{
    char form[LONGEST], text[LONGEST];
    va_list values;
    if (!receiver || !message) return;
    harmless(message, form, sizeof form);
    va_start(values, message);
    vsnprintf(text, sizeof text, form, values);
    va_end(values);
    receiver(environment, name, status, category, text);
}
