// SPDX-License-Identifier: Apache-2.0
#include "cad_common.h"

#include <IGESControl_Controller.hxx>
#include <Interface_Static.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <STEPCAFControl_Controller.hxx>
#include <XCAFApp_Application.hxx>

namespace robomosp::cad_exchange {

void prepare_occt() {
  const Handle(Message_Messenger) messenger = Message::DefaultMessenger();
  messenger->ChangePrinters().Clear();
  STEPCAFControl_Controller::Init();
  IGESControl_Controller::Init();
  Interface_Static::SetCVal("xstep.cascade.unit", "MM");
}

Handle(TDocStd_Document) new_document() {
  Handle(TDocStd_Document) document;
  XCAFApp_Application::GetApplication()->NewDocument("BinXCAF", document);
  return document;
}

}  // namespace robomosp::cad_exchange
