!> The page of all keywords, `input/KEYWORDS.md`, with its list of contents made anew.
module keyword_manual
  use text, only: lower_case
  use keyword_table, only: keyword_table_t
  use all_keywords, only: list_keywords
  use embedded_page, only: embedded_page_text
  implicit none
  private

  public :: keyword_manual_text

  character(*), parameter :: feed = new_line("a")
  character(*), parameter :: head = "| Keyword | |"//feed//"|---|---|"//feed   !! of the contents

contains

  !> The whole page, lines ended by line feeds, of the keywords of the program or of others.
  function keyword_manual_text(keywords) result(manual)
    type(keyword_table_t), intent(in), optional :: keywords
    character(:), allocatable :: manual
    type(keyword_table_t) :: table
    integer :: i, j

    call list_keywords(table, keywords)
    manual = embedded_page_text()
    manual = manual(:index(manual, head) - 1)//head
    do i = 1, size(table%items)
      associate (name => table%items(i)%name, text => table%items(i)%text)
        manual = manual//"| [*"//name//"](#"
        do j = 1, len(name)
          manual = manual//merge("-", lower_case(name(j:j)), name(j:j) == " ")
        end do
        manual = manual//") | "//text(:index(text//" ", ". "))//" |"//feed
      end associate
    end do
    do i = 1, size(table%items)
      manual = manual//feed//table%items(i)%page
    end do
  end function keyword_manual_text

end module keyword_manual
