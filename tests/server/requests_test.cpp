// What requests say: formats, windows, heads, who may ask.
#include <gtest/gtest.h>

#include "server/FrameQuery.h"
#include "server/Refusal.h"
#include "server/RequestHead.h"

namespace virga::server {
namespace {

template <class Work>
int statusOf(Work&& work)
{
    try {
        work();
        return 200;
    } catch (const Refusal& refusal) {
        return refusal.status();
    }
}

std::string headOf(const std::string& lines) { return "GET / HTTP/1.1\r\n" + lines + "\r\n"; }

TEST(Accept, TheWeightiestNamedFormatIsTaken)
{
    EXPECT_EQ(chooseFormat(""), Format::Png);
    EXPECT_EQ(chooseFormat("*/*"), Format::Png);
    EXPECT_EQ(chooseFormat("image/*"), Format::Png);
    EXPECT_EQ(chooseFormat("image/x-exr"), Format::Exr);
    EXPECT_EQ(chooseFormat("image/png;q=0.2, image/jpeg;q=0.9"), Format::Jpeg);
    EXPECT_EQ(chooseFormat("IMAGE/EXR , text/html"), Format::Exr);
    EXPECT_EQ(chooseFormat("image/png;q=0, */*"), Format::Jpeg);  // the closer entry holds: no PNG
    EXPECT_EQ(chooseFormat("application/*"), Format::Raw);        // shared memory must be named
    EXPECT_EQ(chooseFormat(sharedType), Format::Shared);
    EXPECT_EQ(statusOf([] { chooseFormat("text/html"); }), 406);
    EXPECT_EQ(statusOf([] { chooseFormat("image/png;q=0"); }), 406);
}

TEST(Query, EscapesAreMadePlainAndBrokenOnesRefused)
{
    EXPECT_EQ(parseQuery("a=1%2C2+3&b&&c=%C3%A9"), (Query{{"a", "1,2 3"}, {"b", ""}, {"c", "\xc3\xa9"}}));
    EXPECT_EQ(decoded("a+b", false), "a+b");
    for (const char* text : {"%", "%2", "%zz", "a=%0a", "a=%00"})
        EXPECT_EQ(statusOf([&] { parseQuery(text); }), 400) << text;
}

TEST(Query, WindowsAreFourWholeNumbers)
{
    EXPECT_EQ(parseWindow("region", "-3,4,50,60"), (Window{-3, 4, 50, 60}));
    for (const char* text : {"", "1,2,3", "1,2,3,4,5", "1,2,0,4", "1,2,3,16385", "70000,0,1,1", "1.5,0,1,1", " 1,0,1,1",
                             "99999999999,0,1,1"})
        EXPECT_EQ(statusOf([&] { parseWindow("region", text); }), 400) << text;
}

TEST(Query, SaysWhichWordItMayHaveMeant)
{
    try {
        parseFrameQuery(0, {{"sclae", "1"}});
        FAIL();
    } catch (const Refusal& refusal) {
        EXPECT_NE(std::string(refusal.what()).find("did you mean 'scale'"), std::string::npos) << refusal.what();
    }
}

TEST(Head, TakesWhatItShould)
{
    const RequestHead head = parseHead(
        "PUT /a?b=c HTTP/1.1\r\nhost: localhost:80\r\nCONTENT-LENGTH: 12\r\nAuthorization: Bearer  abc \r\n\r\n");
    EXPECT_EQ(head.method, "PUT");
    EXPECT_EQ(head.target, "/a?b=c");
    EXPECT_EQ(head.contentLength, 12u);
    EXPECT_EQ(head.token, "abc");
    EXPECT_EQ(head.host, "localhost:80");
}

TEST(Head, RefusesWhatTwoReadersCouldTakeForDifferentThings)
{
    const auto status = [](const std::string& text) { return statusOf([&] { parseHead(text); }); };
    EXPECT_EQ(status(headOf("")), 200);
    EXPECT_EQ(status(headOf("Content-Length: 0\r\nContent-Length: 0\r\n")), 400);
    EXPECT_EQ(status(headOf("Content-Length: +1\r\n")), 400);
    EXPECT_EQ(status(headOf("Content-Length: 1, 1\r\n")), 400);
    EXPECT_EQ(status(headOf("Content-Length: 99999999999999999999\r\n")), 400);
    EXPECT_EQ(status(headOf("Content-Length: 5\r\n")), 400);  // a GET
    EXPECT_EQ(status(headOf("Transfer-Encoding: chunked\r\n")), 411);
    EXPECT_EQ(status(headOf("Content-Encoding: gzip\r\n")), 415);
    EXPECT_EQ(status(headOf("Content-Type: multipart/form-data; boundary=x\r\n")), 415);
    EXPECT_EQ(status(headOf("no colon\r\n")), 400);
    EXPECT_EQ(status(headOf("Host : x\r\n")), 400);
    EXPECT_EQ(status(headOf(" folded: x\r\n")), 400);
    EXPECT_EQ(status(headOf("A: b\nC: d\r\n")), 400);
    EXPECT_EQ(status(headOf("Host: a\r\nHost: b\r\n")), 400);
    EXPECT_EQ(status("GET  HTTP/1.1\r\n\r\n"), 400);
    EXPECT_EQ(status("GET http://x/ HTTP/1.1\r\n\r\n"), 400);
    EXPECT_EQ(status("GET / HTTP/2.0\r\n\r\n"), 505);
    EXPECT_EQ(status("TRACE / HTTP/1.1\r\n\r\n"), 405);
    EXPECT_EQ(status("GET /" + std::string(5000, 'a') + " HTTP/1.1\r\n\r\n"), 414);
    EXPECT_EQ(status(headOf("A: " + std::string(20000, 'b') + "\r\n")), 431);
}

TEST(Admission, OnlyThisMachinesNamesAndPagesOfThisServer)
{
    const auto status = [](const char* host, const char* origin, const char* token, bool isPublic = false) {
        RequestHead head;
        head.host = host, head.origin = origin, head.token = token;
        return statusOf([&] { admit(head, {"right", isPublic}, true); });
    };
    EXPECT_EQ(status("localhost:8717", "", "right"), 200);
    EXPECT_EQ(status("127.0.0.1", "", "right"), 200);
    EXPECT_EQ(status("[::1]:8717", "http://[::1]:8717", "right"), 200);
    EXPECT_EQ(status("rebound.example:8717", "", "right"), 403);
    EXPECT_EQ(status("localhost.evil.example", "", "right"), 403);
    EXPECT_EQ(status("", "", "right"), 403);
    EXPECT_EQ(status("localhost:8717", "http://evil.example", "right"), 403);
    EXPECT_EQ(status("localhost:8717", "http://localhost:9999", "right"), 403);
    EXPECT_EQ(status("localhost:8717", "null", "right"), 403);
    EXPECT_EQ(status("shots.example:8717", "http://shots.example:8717", "right", true), 200);
    EXPECT_EQ(status("shots.example:8717", "http://evil.example", "right", true), 403);
    for (const char* token : {"", "wrong", "righ", "rightright", "Right"})
        EXPECT_EQ(status("localhost", "", token), 401) << token;
    RequestHead plain;
    plain.host = "localhost";
    EXPECT_EQ(statusOf([&] { admit(plain, {"", false}, true); }), 401);  // no token is no way in
    EXPECT_EQ(statusOf([&] { admit(plain, {"right", false}, false); }), 200);
}

}  // namespace
}  // namespace virga::server
